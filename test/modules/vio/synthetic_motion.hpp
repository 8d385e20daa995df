#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"
#include "test/support/random_pose.hpp"

namespace km {

inline constexpr double kGravity_mps2 = 9.81;

/// A motion known in closed form: position and rotation vector are sums of a line and a sine per
/// axis. All of it is differentiable, so that the inertial samples are exact.
struct SyntheticMotion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d amplitude_m{0.3, 0.4, 0.2};
  Eigen::Vector3d frequency{2.1, 1.7, 2.6};  ///< [rad/s]
  Eigen::Vector3d turn_amplitude{0.15, 0.2, 0.3};
  Eigen::Vector3d turn_frequency{1.3, 1.9, 1.1};
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();

  /// A body that moves at constant velocity without turning.
  [[nodiscard]] static SyntheticMotion straight(const Eigen::Vector3d& velocity) {
    SyntheticMotion motion;
    motion.velocity = velocity;
    motion.amplitude_m.setZero();
    motion.turn_amplitude.setZero();
    return motion;
  }
  [[nodiscard]] static SyntheticMotion standing() { return straight(Eigen::Vector3d::Zero()); }

  [[nodiscard]] Eigen::Vector3d position(double t) const {
    return velocity * t + (amplitude_m.array() * (frequency.array() * t).sin()).matrix();
  }
  [[nodiscard]] Eigen::Vector3d speed(double t) const {
    return velocity +
           (amplitude_m.array() * frequency.array() * (frequency.array() * t).cos()).matrix();
  }
  [[nodiscard]] Eigen::Matrix3d rotation(double t) const { return so3_exp(rotation_vector(t)); }

  [[nodiscard]] OdometryState state(Stamp stamp) const {
    const double t = seconds_between(0, stamp);
    OdometryState s{.stamp = stamp,
                    .T_odom_body = make_pose(rotation(t), position(t)),
                    .v_odom = speed(t),
                    .gyro_bias = gyro_bias,
                    .accel_bias = accel_bias};
    return s;
  }

  [[nodiscard]] ImuSample sample(Stamp stamp) const {
    const double t = seconds_between(0, stamp);
    const auto wt = frequency.array() * t;
    const Eigen::Vector3d acceleration =
        -(amplitude_m.array() * frequency.array().square() * wt.sin()).matrix();
    const Eigen::Vector3d turn_rate =
        (turn_amplitude.array() * turn_frequency.array() * (turn_frequency.array() * t).cos())
            .matrix();
    const Eigen::Vector3d up(0.0, 0.0, kGravity_mps2);
    return {stamp, so3_right_jacobian(rotation_vector(t)) * turn_rate + gyro_bias,
            rotation(t).transpose() * (acceleration + up) + accel_bias};
  }

  /// Samples every `step` from `from` to `to`, both included.
  [[nodiscard]] std::vector<ImuSample> samples(Stamp from, Stamp to, Stamp step) const {
    std::vector<ImuSample> result;
    for (Stamp s = from; s <= to; s += step) result.push_back(sample(s));
    return result;
  }

 private:
  [[nodiscard]] Eigen::Vector3d rotation_vector(double t) const {
    return (turn_amplitude.array() * (turn_frequency.array() * t).sin()).matrix();
  }
};

/// Two cameras that look along the body's x axis, the image's x axis being -y of the body.
inline SensorRig synthetic_rig() {
  Camera camera{.width = 752, .height = 480, .fx = 458.0, .fy = 458.0, .cx = 376.0, .cy = 240.0};
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_body_cam = make_pose(R_body_cam, {0.05, 0.055, 0.0});
  SensorRig rig;
  rig.stereo.cameras = {camera, camera};
  rig.stereo.cameras[1].T_body_cam.translation().y() -= 0.11;
  return rig;
}

/// Landmarks in front of the cameras, and the output of a tracker without faults.
class SyntheticWorld {
 public:
  SyntheticWorld(SyntheticMotion motion, unsigned seed, std::size_t landmarks = 80)
      : motion_(std::move(motion)), rng_(seed) {
    std::uniform_real_distribution<double> depth(1.5, 8.0), side(-0.9, 0.9);
    for (std::size_t k = 0; k < landmarks; ++k) {
      const double x = depth(rng_);
      const double y = side(rng_) * x;
      const double z = side(rng_) * x;
      landmarks_.emplace_back(x, y, z);
    }
  }

  /// Image at `stamp` with image noise, and the exact inertial samples since `last`; the first
  /// image has none.
  [[nodiscard]] InertialFrame frame(Stamp last, Stamp stamp, double noise_px = 0.0) {
    constexpr Stamp kImuStep = 5'000'000;
    InertialFrame frame;
    frame.tracked.stamp = stamp;
    if (last < stamp) frame.samples = motion_.samples(last, stamp, kImuStep);
    const SE3 T_odom_body = motion_.state(stamp).T_odom_body;
    for (std::size_t k = 0; k < landmarks_.size(); ++k) {
      TrackedFeature feature{.id = k, .right = {}};
      const auto left = see(0, T_odom_body, landmarks_[k], noise_px);
      if (!left) continue;
      feature.left = *left;
      feature.right = see(1, T_odom_body, landmarks_[k], noise_px);
      frame.tracked.features.push_back(feature);
    }
    return frame;
  }

  /// `count` images at 20 Hz from time zero.
  [[nodiscard]] std::vector<InertialFrame> frames(int count, double noise_px = 0.0) {
    std::vector<InertialFrame> result;
    for (int k = 0; k < count; ++k)
      result.push_back(frame(kFrameStep * std::max(k - 1, 0), kFrameStep * k, noise_px));
    return result;
  }

  [[nodiscard]] std::vector<OdometryState> states(int count) const {
    std::vector<OdometryState> result;
    for (int k = 0; k < count; ++k) result.push_back(motion_.state(kFrameStep * k));
    return result;
  }

  [[nodiscard]] const SyntheticMotion& motion() const { return motion_; }

  static constexpr Stamp kFrameStep = 50'000'000;

 private:
  std::optional<Eigen::Vector2d> see(std::size_t c, const SE3& T_odom_body,
                                     const Eigen::Vector3d& p_odom, double noise_px) {
    const Camera& camera = rig_.stereo.cameras[c];
    const Eigen::Vector3d p = (T_odom_body * camera.T_body_cam).inverse() * p_odom;
    if (p.z() < 0.3) return std::nullopt;
    const Eigen::Vector2d bearing = p.head<2>() / p.z();
    if (std::abs(bearing.x()) > 0.8 || std::abs(bearing.y()) > 0.52) return std::nullopt;
    return bearing + noise_px / camera.fx * random_vector<2>(rng_);
  }

  SyntheticMotion motion_;
  SensorRig rig_ = synthetic_rig();
  std::mt19937 rng_;
  std::vector<Eigen::Vector3d> landmarks_;
};

}  // namespace km
