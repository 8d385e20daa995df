#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <string_view>

namespace km {

/// A JSON document. Throws std::runtime_error naming the file.
[[nodiscard]] YAML::Node read_json(const std::filesystem::path& file);

/// The number at a path like "optimized.joint.position_m.rmse"; nullopt if there is none.
[[nodiscard]] std::optional<double> number_at(const YAML::Node& root, std::string_view path);

/// The node at a path; undefined if there is none.
[[nodiscard]] YAML::Node node_at(const YAML::Node& root, std::string_view path);

}  // namespace km
