#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "modules/core/camera.hpp"
#include "modules/core/config.hpp"

namespace km {

// What calibrations of sensors say, whichever file holds them. Beyond, numbers overflow or lose
// their digits further on: the limits lie some orders of magnitude outside what is sold. Ring-laser
// gyroscopes have a noise of 3e-7 rad/s/sqrt(Hz), those of telephones 3e-4; simulators write
// smaller ones.
inline constexpr Bounds<double> kGyroNoise{1e-9, 1.0};    ///< [rad/s/sqrt(Hz)]
inline constexpr Bounds<double> kGyroWalk{1e-10, 1.0};    ///< [rad/s^2/sqrt(Hz)]
inline constexpr Bounds<double> kAccelNoise{1e-8, 10.0};  ///< [m/s^2/sqrt(Hz)]
inline constexpr Bounds<double> kAccelWalk{1e-10, 10.0};  ///< [m/s^3/sqrt(Hz)]
inline constexpr Bounds<double> kImuRate_hz{1.0, 1e5};
inline constexpr Bounds<double> kDepthScale_m{1e-6, 1.0};
inline constexpr Bounds<double> kDepthRange_m{1e-3, 1e4};
inline constexpr Bounds<double> kDepthBaseline_m{1e-3, 100.0};
inline constexpr Bounds<double> kTimeOffset_s{-10.0, 10.0};  ///< Of cameras and inertial sensor.

/// Why these are no image's width and height [px], no focal lengths and principal point [px], no
/// coefficients of a lens; nullopt if they may be.
[[nodiscard]] std::optional<std::string> resolution_problem(double width, double height);
[[nodiscard]] std::optional<std::string> intrinsics_problem(const Camera& camera);
[[nodiscard]] std::optional<std::string> coefficients_problem(std::span<const double> values);

/// Likewise of a 4x4 matrix that is to be a rigid transform with a lever that fits on a robot.
[[nodiscard]] std::optional<std::string> transform_problem(const Eigen::Matrix4d& T);

/// Likewise of a pair of cameras: both in one place, or the right one on the left.
[[nodiscard]] std::optional<std::string> pair_problem(const StereoRig& rig);

/// The rigid transform of a matrix without a transform_problem(): with the nearest rotation.
[[nodiscard]] SE3 rigid_transform(const Eigen::Matrix4d& T);

}  // namespace km
