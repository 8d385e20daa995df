#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/diagnosis/inertial_fit.hpp"

namespace km {

/// Fit of the accelerations of the body by images and depth to those of the accelerometer: images =
/// scale * accelerometer + gravity. The scale is 1 if both have the right unit and sign.
struct AccelerationFit {
  std::size_t steps = 0;
  double scale = 0.0, sigma = 0.0;
};

/// Compares changes of the mean velocity between adjacent steps, in the body frame at the start of
/// a window of at most a second and a half. Gravity and bias are the mean of the window. Rotations
/// are those of the images. Changes with large residuals are dropped. `offset_s`: see
/// InertialFit::offset_s. nullopt for fewer than 20 changes.
[[nodiscard]] std::optional<AccelerationFit> fit_acceleration(std::span<const VisualRotation> seen,
                                                              std::span<const ImuSample> samples,
                                                              const SE3& T_body_cam,
                                                              double offset_s);

}  // namespace km
