#pragma once

#include <optional>
#include <span>

#include "modules/core/camera/camera.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// Estimate of the focal lengths of a stereo pair from a gyroscope.
struct FocalFit {
  std::size_t steps = 0, points = 0;
  /// Ratio of the best focal length to the given focal length, common to both cameras.
  double factor = 1.0;
  double sigma = 0.0;     ///< Standard deviation of the factor.
  double error_px = 0.0;  ///< Robust rms of the reprojection errors.
};

/// The fit uses points with depths from the right image. Their motion to the next image follows
/// from the rotation that the gyroscope measures, any translation, and the focal length. The fit
/// minimises the sum of squares with Geman-McClure weights by Gauss-Newton from `fit`. Its
/// variables are the translation of each step (eliminated by Schur complements), the rotation
/// from gyroscope to camera, the constant rate of InertialFit, and the factor. If images determined
/// rotation and translation, the translation could absorb the error of a wrong focal length. With
/// the gyroscope's rotation it cannot.
///
/// `sigma` covers the noise and a systematic error of 0.01 px, the smallest that trackers have.
/// nullopt for fewer than 20 steps of 30 points with depth, or if the fit does not converge.
[[nodiscard]] std::optional<FocalFit> fit_focal(std::span<const TrackedStep> steps,
                                                const StereoRig& rig,
                                                std::span<const ImuSample> samples,
                                                const InertialFit& fit);

}  // namespace km
