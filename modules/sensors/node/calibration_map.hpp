#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/config.hpp"

namespace YAML {
class Node;
}

namespace km {

/// A map of keys in a calibration file, YAML or JSON (which is YAML). Every getter throws
/// DatasetError with file, line and key if a value is missing or invalid.
class CalibrationMap {
 public:
  /// Reads a whole file.
  explicit CalibrationMap(const std::filesystem::path& file);

  [[nodiscard]] const std::filesystem::path& file() const { return *file_; }
  [[nodiscard]] bool has(const char* key) const;
  [[nodiscard]] bool is_list(const char* key) const;
  /// The first of `keys` that exists; nullptr if none does.
  [[nodiscard]] const char* first_of(std::initializer_list<const char*> keys) const;

  [[nodiscard]] CalibrationMap map(const char* key) const;
  /// A list of maps.
  [[nodiscard]] std::vector<CalibrationMap> maps(const char* key) const;

  [[nodiscard]] std::string word(const char* key) const;
  /// nullopt for a value that is not a finite number.
  [[nodiscard]] std::optional<double> number(const char* key) const;
  [[nodiscard]] double number(const char* key, const Bounds<double>& bounds) const;
  /// Returns `otherwise` if there is no such key.
  [[nodiscard]] double number(const char* key, const Bounds<double>& bounds,
                              double otherwise) const;

  /// All finite numbers of a list, or of a list of lists, row after row.
  [[nodiscard]] std::vector<double> numbers(const char* key) const;
  /// Exactly `count` numbers. If there are more or fewer, the message contains `meaning`.
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t count,
                                            const char* meaning) const;
  /// A list of lists.
  [[nodiscard]] std::vector<std::vector<double>> lists(const char* key) const;

  /// A 4x4 matrix, row by row in one list or in four lists. The nearest rotation replaces its
  /// rotation. transform_problem() lists the reasons for refusal. `name` is used in messages.
  [[nodiscard]] SE3 transform(const char* key, const char* name) const;

  /// Throws DatasetError with the place of a key, or of the map if there is no such key.
  [[noreturn]] void fail(const char* key, const std::string& problem) const;
  /// "FILE line N" of a key.
  [[nodiscard]] std::string place_of(const char* key) const;

 private:
  CalibrationMap(std::shared_ptr<const std::filesystem::path> file, const YAML::Node& node);

  [[nodiscard]] YAML::Node child(const char* key) const;
  [[noreturn]] void fail(const YAML::Node& node, const std::string& problem) const;
  [[nodiscard]] std::vector<double> numbers(const YAML::Node& node, const char* name) const;
  void append(const YAML::Node& list, const char* name, std::vector<double>& values) const;

  std::shared_ptr<const std::filesystem::path> file_;
  std::shared_ptr<const YAML::Node> node_;
};

/// The camera without its pose, from the keys `resolution`, `camera_model`, `intrinsics`,
/// `distortion_model` and `coefficients_key`. EuRoC's sensor.yaml and Kalibr's chains have these
/// keys in common:
///
///     pinhole  fu, fv, cu, cv             radtan: k1, k2, p1, p2[, k3[, k4, k5, k6]]
///                                         equidistant: k1, k2, k3, k4
///                                         none
///     omni     xi, fu, fv, cu, cv         radtan: k1, k2, p1, p2; none
///     ds       xi, alpha, fu, fv, cu, cv  none
///
/// EuRoC writes radial-tangential for radtan. Throws DatasetError with file, line, key and value
/// for other models and for values that calibration_limits.hpp refuses.
[[nodiscard]] Camera read_camera(const CalibrationMap& map, const char* coefficients_key);

/// Reads `resolution` and the `intrinsics` of a pinhole into `camera`, whose lens does not change.
/// Errors as for read_camera().
void read_pinhole(const CalibrationMap& map, Camera& camera);

/// The optional keys `min_range_m` (0) and `max_range_m` of a depth sensor.
[[nodiscard]] DepthRange read_depth_range(const CalibrationMap& map, double max_m);

/// The lens of a calibration. If Lens refuses the coefficients, the message contains the place of
/// `key`.
[[nodiscard]] Lens lens_of(const CalibrationMap& map, const char* key, LensModel model,
                           const std::vector<double>& coefficients);

/// Throws DatasetError with the place of `key` for focal lengths and principal points that no
/// camera has.
void check_intrinsics(const CalibrationMap& map, const char* key, const Camera& camera);

}  // namespace km
