#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/geometry.hpp"

namespace km {

/// One sensor.yaml of a EuRoC/ASL folder. Every getter throws DatasetError with file and line for
/// what is missing or not what it should be.
class SensorYaml {
 public:
  explicit SensorYaml(std::filesystem::path file);
  ~SensorYaml();

  [[nodiscard]] bool has(const char* key) const;
  [[nodiscard]] std::string word(const char* key) const;

  /// nullopt for what is not a number, infinite or not-a-number.
  [[nodiscard]] std::optional<double> number(const char* key) const;

  /// Positive and finite.
  [[nodiscard]] double positive(const char* key) const;

  /// The same, or `otherwise` without the key.
  [[nodiscard]] double positive(const char* key, double otherwise) const;

  /// `count` finite numbers. `meaning` is said where there are not as many.
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t count,
                                            const char* meaning) const;

  /// T_BS, its rotation made exact; see read_euroc_rig() for what is refused.
  [[nodiscard]] SE3 extrinsics() const;

  /// Refuses the value of a key that exists.
  [[noreturn]] void fail(const char* key, const std::string& problem) const;

 private:
  struct Document;
  std::unique_ptr<const Document> document_;
};

}  // namespace km
