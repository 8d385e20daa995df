#pragma once

#include <optional>
#include <span>

#include "modules/core/camera.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// What a gyroscope says of the focal lengths of a stereo pair.
struct FocalFit {
  std::size_t steps = 0, points = 0;
  double factor = 1.0;    ///< Of both cameras: the focal length that fits best over the given one.
  double sigma = 0.0;     ///< Of the factor.
  double error_px = 0.0;  ///< Rms of the points about where they should be, robust.
};

/// Points with depths of the right image move from one image to the next as the rotation that the
/// gyroscope measures, any translation, and the focal length have it. The least sum of squares with
/// Geman-McClure weights, over the translation of each step (taken out by Schur complements), the
/// gyroscope's mounting and constant, and the factor; Gauss-Newton from `fit`. As the gyroscope
/// tells the rotation, a translation cannot take what a wrong focal length leaves, as it can where
/// images tell both.
///
/// `sigma` is of the noise and of a systematic error of 0.01 px, the least that trackers have.
/// nullopt for fewer than 20 steps of 30 points with depth, or where it does not converge.
[[nodiscard]] std::optional<FocalFit> fit_focal(std::span<const TrackedStep> steps,
                                                const StereoRig& rig,
                                                std::span<const ImuSample> samples,
                                                const InertialFit& fit);

}  // namespace km
