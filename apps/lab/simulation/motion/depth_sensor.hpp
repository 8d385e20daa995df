#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace km {

/// A stereo camera that measures depth.
struct DepthSensorOptions {
  double focal_px = 458.0;
  double baseline_m = 0.1;
  double min_range_m = 0.4;
  double max_range_m = 20.0;
};

/// Measured depth [mm] for a true depth image (z in the camera's frame [m], row-major, 0: sky); 0
/// for no depth. The disparity d = f b / z gets noise and is rounded to steps, so that the error
/// grows with the square of range: sigma_z = z^2 / (f b) * sigma_d. There is no depth outside the
/// range, where a nearer surface blocks the right camera's view, and at random at edges. `seed` is
/// that of the frame.
[[nodiscard]] std::vector<std::uint16_t> measured_depth(std::span<const float> depth_m, int width,
                                                        int height, std::uint64_t seed,
                                                        const DepthSensorOptions& options);

}  // namespace km
