#include "runtime/config_layers.hpp"

namespace km {

void ConfigLayers::add_file(const std::filesystem::path& file) try {
  add_document(load_yaml(file), file.string());
} catch (const ConfigError& error) {
  problems_.others += std::string(error.what()) + '\n';
}

void ConfigLayers::add_text(const std::string& text, const std::string& origin) try {
  add_document(parse_yaml(text, origin), origin);
} catch (const ConfigError& error) {
  problems_.others += std::string(error.what()) + '\n';
}

void ConfigLayers::add_document(const YAML::Node& document, const std::string& origin) {
  const ConfigContext context{problems_};
  for (const auto& [name, map] : read_section(document, "", origin, context).values) {
    ConfigSection& merged = sections_[name];
    merged.where = map.where;
    for (const auto& [key, value] : read_section(map.node, name, origin, context).values)
      merged.values.insert_or_assign(key, value);
  }
}

void ConfigLayers::add_override(const std::string& assignment) try {
  const std::string where = std::string(kCommandLine) + ", " + assignment;
  const std::size_t equals = assignment.find('=');
  const std::size_t dot = assignment.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals || dot == 0 ||
      dot + 1 == equals) {
    problems_.others += where + ": not of the form section.key=value\n";
    return;
  }
  ConfigSection& section = sections_[assignment.substr(0, dot)];
  if (section.where.empty()) section.where = where;
  section.values.insert_or_assign(
      assignment.substr(dot + 1, equals - dot - 1),
      ConfigValue{parse_yaml(assignment.substr(equals + 1), where), where, where});
} catch (const ConfigError& error) {
  problems_.others += std::string(error.what()) + '\n';
}

void ConfigLayers::finish() const {
  ConfigProblems problems = problems_;
  for (const auto& [name, section] : sections_)
    if (!known_.contains(name))
      problems.unknown +=
          section.where + ": unknown section " + name + suggestion(name, known_) + '\n';
  problems.finish();
}

}  // namespace km
