#include "runtime/yaml_config.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <sstream>

namespace km {
namespace {

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

}  // namespace

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
                           std::string& problems) {
  ConfigSection section{place_of(node, file), {}};
  if (node.IsNull()) return section;
  if (!node.IsMap()) {
    problems += section.where + ": section " + name + " is not a map of keys\n";
    return section;
  }
  for (const auto& entry : node) {
    const std::string where = place_of(entry.first, file);
    if (!entry.first.IsScalar()) {
      problems += where + ": a key of section " + name + " is not a word\n";
      continue;
    }
    const std::string key = entry.first.Scalar();
    const auto [earlier, fresh] = section.values.try_emplace(key, ConfigValue{entry.second, where});
    if (!fresh)
      problems +=
          where + ": " + name + '.' + key + " is repeated, see " + earlier->second.where + '\n';
  }
  return section;
}

std::string YamlFields::problems() const {
  std::string result = problems_;
  for (const auto& [key, value] : section_.values)
    if (!known_.contains(key))
      result += value.where + ": unknown key " + name_ + '.' + key + suggestion(key, known_) + '\n';
  return result;
}

const ConfigValue* YamlFields::find(const char* key) {
  known_.insert(key);
  const auto found = section_.values.find(key);
  return found == section_.values.end() ? nullptr : &found->second;
}

void YamlFields::wrong(const char* key, const ConfigValue& found, const std::string& expected) {
  problems_ += found.where + ": " + name_ + '.' + key + " = " + one_line(found.node) + " is not " +
               expected + '\n';
}

void YamlFields::append(const ConfigChecker& checker, const ConfigValue& found) try {
  checker.finish();
} catch (const ConfigError& error) {
  problems_ += found.where + ": " + error.what();
}

}  // namespace km
