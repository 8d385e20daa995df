#include "runtime/config_layers.hpp"

#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

namespace km {

void ConfigLayers::add_file(const std::filesystem::path& file) {
  std::ifstream input(file);
  if (!input) {
    problems_ += file.string() + ": cannot open: " + std::generic_category().message(errno) + '\n';
    return;
  }
  std::ostringstream text;
  text << input.rdbuf();
  add_text(text.str(), file.string());
}

void ConfigLayers::add_text(const std::string& text, const std::string& origin) try {
  const YAML::Node document = YAML::Load(text);
  if (document.IsNull()) return;
  if (!document.IsMap()) {
    problems_ += place_of(document, origin) + ": not a map of sections\n";
    return;
  }
  std::set<std::string> seen;
  for (const auto& entry : document) {
    const auto name = entry.first.as<std::string>();
    if (!seen.insert(name).second)
      problems_ += place_of(entry.first, origin) + ": section " + name + " is repeated\n";
    ConfigSection section = read_section(entry.second, name, origin, problems_);
    ConfigSection& merged = sections_[name];
    merged.where = place_of(entry.first, origin);
    for (auto& [key, value] : section.values) merged.values.insert_or_assign(key, value);
  }
} catch (const YAML::Exception& error) {
  problems_ +=
      origin + ':' + std::to_string(error.mark.line + 1) + ": not YAML: " + error.msg + '\n';
}

void ConfigLayers::add_override(const std::string& assignment) try {
  const std::string where = "command line, " + assignment;
  const std::size_t equals = assignment.find('=');
  const std::size_t dot = assignment.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals || dot == 0 ||
      dot + 1 == equals) {
    problems_ += where + ": not of the form section.key=value\n";
    return;
  }
  ConfigSection& section = sections_[assignment.substr(0, dot)];
  if (section.where.empty()) section.where = where;
  const YAML::Node value = YAML::Load(assignment.substr(equals + 1));
  section.values.insert_or_assign(assignment.substr(dot + 1, equals - dot - 1),
                                  ConfigValue{value, where});
} catch (const YAML::Exception& error) {
  problems_ += "command line, " + assignment + ": not YAML: " + error.msg + '\n';
}

void ConfigLayers::finish() const {
  std::string problems = problems_;
  for (const auto& [name, section] : sections_)
    if (!known_.contains(name))
      problems += section.where + ": unknown section " + name + suggestion(name, known_) + '\n';
  if (!problems.empty()) throw ConfigError(problems);
}

}  // namespace km
