#pragma once

#include <cstdint>

#include "modules/core/camera.hpp"
#include "modules/core/config.hpp"

namespace km {

/// Sizes of the differences between the cameras' true calibration and the one that the robot gets.
/// Signs and axes are random; 0: no difference.
struct CalibrationErrorConfig {
  static constexpr const char* kSection = "calibration_error";

  double focal_share = 0.0;
  double mounting_rad = 0.0;
  double stereo_rad = 0.0;

  void visit_fields(auto& visitor) {
    visitor.field("focal_share", focal_share, {0.0, 0.2},
                  "share of the focal lengths, the same for both cameras");
    visitor.field("mounting_rad", mounting_rad, {0.0, 0.5},
                  "rad, rotation of the cameras together against the inertial sensor");
    visitor.field("stereo_rad", stereo_rad, {0.0, 0.1},
                  "rad, rotation of the right camera against the left one");
  }
};

/// The calibration that a robot with the true rig `truth` gets. The pair of cameras rotates about
/// the middle between them. Throws ConfigError.
[[nodiscard]] SensorRig told_rig(const SensorRig& truth, const CalibrationErrorConfig& config,
                                 std::uint64_t seed);

}  // namespace km
