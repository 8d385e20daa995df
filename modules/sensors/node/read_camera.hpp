#pragma once

#include "modules/core/camera.hpp"
#include "modules/sensors/node/calibration_map.hpp"

namespace km {

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
