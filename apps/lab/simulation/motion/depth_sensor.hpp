#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// A stereo camera that measures depth.
struct DepthSensorOptions {
  static constexpr const char* kSection = "depth_sensor";

  double focal_px = 458.0;
  double baseline_m = 0.1;
  double disparity_noise_px = 0.15;     ///< Standard deviation.
  double disparity_step_px = 1.0 / 16;  ///< Sub-pixel steps of the matcher; 0: none.
  int correlation_px = 4;  ///< Width over which noise is correlated, in pixels; 1: white.
  double min_range_m = 0.4;
  double max_range_m = 20.0;
  double edge_disparity_px =
      1.0;                 ///< Difference to a neighbour above which a pixel counts as an edge.
  double edge_loss = 0.5;  ///< Probability of no depth at an edge.
  bool ideal = false;      ///< Rounding to mm only.

  void visit_fields(auto& visitor) {
    visitor.field("focal_px", focal_px, {1.0, 1e5});
    visitor.field("baseline_m", baseline_m, {1e-3, 10.0});
    visitor.field("disparity_noise_px", disparity_noise_px, {0.0, 10.0});
    visitor.field("disparity_step_px", disparity_step_px, {0.0, 1.0});
    visitor.field("correlation_px", correlation_px, {1, 64});
    visitor.field("min_range_m", min_range_m, {0.0, max_range_m});
    visitor.field("max_range_m", max_range_m, {1e-3, 65.535});
    visitor.field("edge_disparity_px", edge_disparity_px, {0.0, 1e4});
    visitor.field("edge_loss", edge_loss, {0.0, 1.0});
    visitor.field("ideal", ideal);
  }
};

/// Depth images of a stereo camera from true ones.
class DepthSensor {
 public:
  /// Throws ConfigError for options out of range.
  explicit DepthSensor(const DepthSensorOptions& options);

  /// Measured depth [mm] for a true depth image (z in the camera's frame [m], row-major, 0: sky); 0
  /// for no depth. The disparity d = f b / z gets noise and is rounded to steps, so that the error
  /// grows with the square of range: sigma_z = z^2 / (f b) * sigma_d. There is no depth outside the
  /// range, where a nearer surface blocks the right camera's view, and at random at edges. `seed`
  /// is that of the frame. Throws std::invalid_argument if depth_m.size() is not width * height.
  [[nodiscard]] std::vector<std::uint16_t> measure(std::span<const float> depth_m, int width,
                                                   int height, std::uint64_t seed) const;

 private:
  [[nodiscard]] std::uint16_t depth_at(double disparity_px) const;  // [mm]

  DepthSensorOptions options_;
};

}  // namespace km
