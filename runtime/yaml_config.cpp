#include "runtime/yaml_config.hpp"

#include <algorithm>
#include <numeric>
#include <sstream>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxYaml_bytes = std::uintmax_t{16} << 20U;  // people write less
constexpr std::string_view kDataset = "${DATASET}";

// Levenshtein distance, by its recurrence over the rows of the table.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0U);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, substituted}));
    }
  }
  return row.back();
}

std::string one_line(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter.SetSeqFormat(YAML::Flow);
  emitter.SetMapFormat(YAML::Flow);
  emitter << node;
  return emitter.c_str();
}

// Maximum characters of all problems together and of one. Other files cause very many problems.
constexpr std::size_t kMaxMessage = 4000, kMaxProblem = 500;

// Shortens a problem, because it may contain long or unprintable text of a file.
std::string line_of(const std::string& problem) {
  return readable(problem, kMaxProblem) + '\n';
}

std::string joined(const std::string& name, const std::string& key) {
  return name.empty() ? key : name + '.' + key;
}

}  // namespace

void ConfigProblems::finish() const {
  std::string all = unknown + others;
  if (all.empty()) return;
  all.pop_back();  // the last newline
  bool of_command_line = true;
  std::istringstream lines(all);
  for (std::string line; std::getline(lines, line);)
    of_command_line = of_command_line && line.starts_with(kCommandLine);
  if (all.size() > kMaxMessage) {
    const std::size_t end = std::min(all.rfind('\n', kMaxMessage), kMaxMessage);
    const auto cut = std::count(all.begin() + static_cast<std::ptrdiff_t>(end), all.end(), '\n');
    all.resize(end);
    all += "\n... and " + std::to_string(cut) + " more problems";
  }
  if (of_command_line) throw CommandLineError(all);
  throw ConfigError(all);
}

YAML::Node load_yaml(const fs::path& file) try {
  if (const std::string problem = problem_of_file(file); !problem.empty())
    throw ConfigError(file.string() + ": cannot open: " + problem);
  return parse_yaml(read_input_file(file, kMaxYaml_bytes), file.string());
} catch (const InputFileError& error) {
  throw ConfigError(error.what());
}

YAML::Node parse_yaml(const std::string& text, const std::string& origin) try {
  return YAML::Load(text);
} catch (const YAML::Exception& error) {
  throw ConfigError(origin + ':' + std::to_string(error.mark.line + 1) +
                    ": not YAML: " + error.msg);
}

std::string replace_dataset(std::string& text, const ConfigContext& context) {
  const std::size_t variable = text.find(kDataset);
  if (variable == std::string::npos) return "";
  if (context.dataset.empty()) return "needs --dataset";
  text.replace(variable, kDataset.size(), fs::absolute(context.dataset).string());
  return "";
}

std::string resolve_input(std::string name, const ConfigContext& context, Input input,
                          fs::path& path) {
  if (std::string problem = replace_dataset(name, context); !problem.empty()) return problem;
  path = name.empty() ? fs::path() : (context.folder / name).lexically_normal();
  return path.empty() || is_there(path) || !input.must_exist
             ? ""
             : "is no file or folder: there is no " + path.string();
}

std::string place_of(const YAML::Node& node, const std::string& file) {
  const std::string line = std::to_string(node.Mark().line + 1);
  return file.empty() ? "line " + line : file + ':' + line;
}

std::string suggestion(const std::string& word, const std::set<std::string>& known) {
  const std::string* best = nullptr;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance >= best_distance) continue;
    best = &candidate;
    best_distance = distance;
  }
  return best == nullptr ? "" : " (did you mean " + *best + "?)";
}

ConfigSection read_section(const YAML::Node& node, const std::string& name, const std::string& file,
                           const ConfigContext& context) {
  ConfigSection section{place_of(node, file), {}};
  const std::string called = name.empty() ? "the file" : name;
  const auto problem = [&](const std::string& where, const std::string& text) {
    context.problems.others += line_of(where + ": " + text);
  };
  if (node.IsNull()) return section;
  if (!node.IsMap()) {
    problem(section.where, called + " is not a map of keys and values");
    return section;
  }
  for (const auto& entry : node) {
    const std::string where = place_of(entry.first, file);
    if (!entry.first.IsScalar()) {
      problem(where, "a key of " + called + " is not a word");
      continue;
    }
    const std::string& key = entry.first.Scalar();
    const auto [earlier, fresh] =
        section.values.try_emplace(key, ConfigValue{entry.second, file, where});
    if (!fresh) problem(where, joined(name, key) + " is repeated, see " + earlier->second.where);
  }
  return section;
}

std::string YamlFields::decode(const YAML::Node& node, bool& value, AnyValue /*accepted*/) {
  return YAML::convert<bool>::decode(node, value) ? "" : "is not true or false";
}

std::string YamlFields::decode(const YAML::Node& node, std::string& value, AnyValue /*accepted*/) {
  if (node.IsNull()) {  // nothing stands after the key
    value.clear();
    return {};
  }
  return YAML::convert<std::string>::decode(node, value) ? "" : "is not a text";
}

std::string YamlFields::decode(const YAML::Node& node, fs::path& value, AnyValue /*accepted*/) {
  if (!node.IsScalar()) return "is not a path";
  value = node.Scalar();
  return {};
}

std::string YamlFields::decode(const YAML::Node& node, fs::path& value, Input input) const {
  return node.IsScalar() ? resolve_input(node.Scalar(), context_, input, value) : "is not a path";
}

void YamlFields::required(std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    const ConfigValue* found = find(key);
    check(found != nullptr, key, "is missing");
    check(found == nullptr || !found->node.IsSequence() || found->node.size() > 0, key, "is empty");
  }
}

void YamlFields::check(bool ok, const char* key, const std::string& problem,
                       std::optional<std::size_t> element) {
  if (ok || wrong_.contains(key)) return;
  const ConfigValue* found = find(key);
  if (found == nullptr)
    add(section_.where, key, problem);
  else if (element)
    add(place_of(found->node[*element], found->file), key, problem);
  else
    add(found->where, key, "= " + one_line(found->node) + ' ' + problem);
}

void YamlFields::finish() {
  for (const auto& [key, value] : section_.values)
    if (!known_.contains(key))
      context_.problems.unknown +=
          line_of(value.where + ": unknown key " + full_name(key) + suggestion(key, known_));
}

std::string YamlFields::full_name(const std::string& key) const {
  return joined(name_, key);
}

const ConfigValue* YamlFields::find(const char* key) {
  known_.insert(key);
  const auto found = section_.values.find(key);
  return found == section_.values.end() ? nullptr : &found->second;
}

void YamlFields::add(const std::string& where, const char* key, const std::string& problem) {
  context_.problems.others += line_of(where + ": " + full_name(key) + ' ' + problem);
}

}  // namespace km
