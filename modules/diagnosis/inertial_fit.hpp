#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera/frame.hpp"

namespace km {

/// The integral of a gyroscope's rates, linear between samples. The samples must outlive this.
class GyroIntegral {
 public:
  explicit GyroIntegral(std::span<const ImuSample> samples);

  /// True if samples cover the interval.
  [[nodiscard]] bool covers(Stamp from, Stamp to) const;

  /// Integral from the first sample on [rad]. Precondition: covered.
  [[nodiscard]] Eigen::Vector3d until(Stamp stamp) const;

  /// Mean rate [rad/s]. Precondition: covered, from < to.
  [[nodiscard]] Eigen::Vector3d mean(Stamp from, Stamp to) const {
    return (until(to) - until(from)) / seconds_between(from, to);
  }

 private:
  std::span<const ImuSample> samples_;
  std::vector<Eigen::Vector3d> sums_;  // integral up to each sample
};

/// Rotation of the left camera between two images, and its translation if depths are known.
struct VisualRotation {
  Stamp from = 0, to = 0;
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< R_from_to as rotation vector [rad].
  std::optional<Eigen::Vector3d> translation = {};     ///< t_from_to [m].
};

/// Fit of the camera's rotations to those of the gyroscope: image = scale * Q * gyro + constant. It
/// allows any unit, mounting, bias and clock of the gyroscope. Rates [rad/s] are means over a step.
struct InertialFit {
  std::size_t steps = 0;
  double image_rms = 0.0;  ///< Rms of the image's rates about their mean.
  /// Rms of the gyroscope's rates along their principal axes, descending.
  Eigen::Vector3d gyro_rms = Eigen::Vector3d::Zero();
  double explained = 0.0;  ///< Share of the image's variance that the best affine map explains.
  double offset_s = 0.0;   ///< Added to the stamps of images to get the gyroscope's time.
  double offset_sigma_s = 0.0;
  bool offset_at_limit = false;  ///< True if there is no minimum within kMaxOffset_s.
  double scale = 0.0;
  Eigen::Matrix3d Q =
      Eigen::Matrix3d::Identity();  ///< Orthogonal: R_cam_body, if no axis is mirrored.
  double mirror_gain = 0.0;  ///< Decrease of the explained share if a rotation replaces Q; 0 if Q
                             ///< is a rotation.
  Eigen::Vector3d constant = Eigen::Vector3d::Zero();  ///< Rate about the camera's axes [rad/s].
};

inline constexpr double kMaxOffset_s = 0.15;

/// Searches offsets within +-kMaxOffset_s for the smallest sum of squares of the linear regression
/// of the image's rates on the gyroscope's (twelve unknowns). A parabola interpolates the minimum.
/// Steps with large residuals at the best offset are dropped. Q is the orthogonal Procrustes
/// solution (Schoenemann, 1966). nullopt for fewer than 20 steps within the samples.
[[nodiscard]] std::optional<InertialFit> fit_inertial(std::span<const VisualRotation> seen,
                                                      std::span<const ImuSample> samples);

}  // namespace km
