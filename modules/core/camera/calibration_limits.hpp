#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "modules/core/camera/camera.hpp"
#include "modules/core/config.hpp"

namespace km {

// Limits on values in calibrations of sensors in any file. Beyond them, numbers overflow or lose
// digits in later computations. The limits are some orders of magnitude outside the values of real
// sensors. Ring-laser gyroscopes have a noise of 3e-7 rad/s/sqrt(Hz), those of telephones 3e-4;
// simulators write smaller values.
inline constexpr Bounds<double> kGyroNoise{1e-9, 1.0};    ///< [rad/s/sqrt(Hz)]
inline constexpr Bounds<double> kGyroWalk{1e-10, 1.0};    ///< [rad/s^2/sqrt(Hz)]
inline constexpr Bounds<double> kAccelNoise{1e-8, 10.0};  ///< [m/s^2/sqrt(Hz)]
inline constexpr Bounds<double> kAccelWalk{1e-10, 10.0};  ///< [m/s^3/sqrt(Hz)]
inline constexpr Bounds<double> kImuRate_hz{1.0, 1e5};
inline constexpr Bounds<double> kDepthScale_m{1e-6, 1.0};
inline constexpr Bounds<double> kDepthRange_m{1e-3, 1e4};
inline constexpr Bounds<double> kDepthBaseline_m{1e-3, 100.0};
/// Time offset of cameras and inertial sensor.
inline constexpr Bounds<double> kTimeOffset_s{-10.0, 10.0};

/// Each function returns the reason why its values are impossible, or nullopt if they are possible.
/// The values are width and height of an image [px], focal lengths and principal point [px], and
/// coefficients of a lens.
[[nodiscard]] std::optional<std::string> resolution_problem(double width, double height);
[[nodiscard]] std::optional<std::string> intrinsics_problem(const Camera& camera);
[[nodiscard]] std::optional<std::string> coefficients_problem(std::span<const double> values);

/// The reason why a 4x4 matrix is not a rigid transform with a lever that fits on a robot; nullopt
/// if it is.
[[nodiscard]] std::optional<std::string> transform_problem(const Eigen::Matrix4d& T);

/// The reason why two cameras are no stereo pair: equal positions, or left and right exchanged.
/// nullopt if they are a pair.
[[nodiscard]] std::optional<std::string> pair_problem(const StereoRig& rig);

/// The rigid transform of a matrix without a transform_problem(), with the nearest rotation.
[[nodiscard]] SE3 rigid_transform(const Eigen::Matrix4d& T);

}  // namespace km
