#include "apps/experiments/json_numbers.hpp"

#include <stdexcept>
#include <string>

namespace km {

YAML::Node read_json(const std::filesystem::path& file) try {
  return YAML::LoadFile(file.string());  // JSON is YAML
} catch (const YAML::Exception& error) {
  throw std::runtime_error(file.string() + ": " + error.what());
}

YAML::Node node_at(const YAML::Node& root, std::string_view path) {
  YAML::Node node = YAML::Clone(YAML::Node());
  node.reset(root);
  while (!path.empty()) {
    if (!node.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
    const std::size_t dot = path.find('.');
    const YAML::Node child = std::as_const(node)[std::string(path.substr(0, dot))];
    if (!child) return YAML::Node(YAML::NodeType::Undefined);
    node.reset(child);
    path = dot == path.npos ? std::string_view() : path.substr(dot + 1);
  }
  return node;
}

std::optional<double> number_at(const YAML::Node& root, std::string_view path) {
  const YAML::Node node = node_at(root, path);
  double value = 0.0;
  if (!node || !node.IsScalar() || !YAML::convert<double>::decode(node, value)) return std::nullopt;
  return value;
}

}  // namespace km
