#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/geometry.hpp"

namespace km {

/// One sensor.yaml of a EuRoC/ASL folder. Every getter throws DatasetError with file and line for
/// what is missing or not what it should be.
class SensorYaml {
 public:
  explicit SensorYaml(std::filesystem::path file);

  [[nodiscard]] bool has(const char* key) const;
  [[nodiscard]] YAML::Node at(const char* key) const { return child(root_, key); }
  [[nodiscard]] YAML::Node child(const YAML::Node& map, const char* key) const;
  [[nodiscard]] std::string word(const char* key) const;

  /// Positive and finite.
  [[nodiscard]] double positive(const char* key) const;

  /// The same, or `otherwise` without the key.
  [[nodiscard]] double positive(const char* key, double otherwise) const;

  /// `count` finite numbers. `meaning` is said where there are not as many.
  [[nodiscard]] std::vector<double> numbers(const YAML::Node& node, const std::string& key,
                                            std::size_t count, const char* meaning) const;

  /// T_BS, its rotation made exact; see read_euroc_rig() for what is refused.
  [[nodiscard]] SE3 extrinsics() const;

  [[noreturn]] void fail(const YAML::Node& node, const std::string& problem) const;

 private:
  std::filesystem::path file_;
  YAML::Node root_;
};

}  // namespace km
