#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "modules/core/frame.hpp"

namespace km {

/// A rotation of the left camera that images show.
struct SeenRotation {
  Stamp from = 0, to = 0;
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< R_from_to as rotation vector [rad].
};

/// How rotations seen by the camera go with those of the gyroscope: the fit of
/// image = scale * Q * gyro + constant, whatever units, mounting, bias and clock the gyroscope has.
/// Rates [rad/s] are means over a step.
struct InertialFit {
  std::size_t steps = 0;
  double image_rms = 0.0;     ///< Of the image's rates about their mean.
  Eigen::Vector3d gyro_rms =  ///< Of the gyroscope's, along their principal axes, descending.
      Eigen::Vector3d::Zero();
  double explained = 0.0;  ///< Share of the image's variance that any linear map explains.
  double offset_s = 0.0;   ///< Added to stamps of images: they are then the gyroscope's.
  double offset_sigma_s = 0.0;
  bool offset_at_limit = false;  ///< No least within kMaxOffset_s.
  double scale = 0.0;
  Eigen::Matrix3d Q =
      Eigen::Matrix3d::Identity();  ///< Orthogonal: R_cam_body, if no axis is mirrored.
  double mirror_gain = 0.0;  ///< Explained by Q less by the nearest rotation; 0 where Q is one.
  Eigen::Vector3d constant = Eigen::Vector3d::Zero();  ///< About the camera's axes [rad/s].
};

inline constexpr double kMaxOffset_s = 0.15;

/// Offsets within +-kMaxOffset_s are tried for the least sum of squares of the linear regression of
/// the image's rates by the gyroscope's (twelve unknowns); the least is interpolated by a parabola.
/// Steps that the best offset leaves far off are left out. Q is the orthogonal Procrustes solution
/// (Schoenemann, 1966). nullopt for fewer than 20 steps within the samples.
[[nodiscard]] std::optional<InertialFit> fit_inertial(std::span<const SeenRotation> seen,
                                                      std::span<const ImuSample> samples);

}  // namespace km
