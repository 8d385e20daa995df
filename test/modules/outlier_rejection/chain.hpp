#pragma once

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/support/random_pose.hpp"

namespace km {

/// One robot's odometry: keyframes with the covariance accumulated since keyframe 0.
class Chain {
 public:
  explicit Chain(RobotId robot) : robot_(robot) {}

  /// Appends a step with isotropic `variance` [rad^2, m^2].
  Chain& step(const SE3& T_last_next, double variance = 1e-4) {
    poses_.push_back(compose(poses_.back(), {T_last_next, variance * Matrix6::Identity()}));
    return *this;
  }

  [[nodiscard]] std::size_t size() const { return poses_.size(); }
  [[nodiscard]] OdometryPose at(std::size_t i) const {
    return {{robot_, static_cast<std::uint32_t>(i)}, poses_[i].T, poses_[i].Sigma};
  }

 private:
  RobotId robot_;
  std::vector<UncertainPose> poses_{UncertainPose{}};
};

inline SE3 rotz(double angle_rad, double x = 0.0, double y = 0.0) {
  return make_pose(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                   {x, y, 0.0});
}

/// A closure between two keyframes with isotropic `variance`. It does not state its inliers.
inline Closure closure(const OdometryPose& from, const OdometryPose& to, const SE3& T_from_to,
                       double variance = 1e-4) {
  return {from, to, T_from_to, variance * Matrix6::Identity(), 0, 0.8};
}

/// The cycle through two closures from one robot to another, from keyframe a_i to a_i, composed
/// transform by transform: what closes_within() computes faster.
inline UncertainPose cycle_through(const Closure& i, const Closure& k) {
  const auto along_odometry = [](const OdometryPose& from, const OdometryPose& to) {
    const UncertainPose T_from{from.T_odom_kf, from.covariance}, T_to{to.T_odom_kf, to.covariance};
    return from.id.index <= to.id.index ? between_on_chain(T_from, T_to)
                                        : inverse(between_on_chain(T_to, T_from));
  };
  const UncertainPose T_ai_bi{i.T_from_to, i.covariance}, T_ak_bk{k.T_from_to, k.covariance};
  const UncertainPose T_ai_bk = compose(T_ai_bi, along_odometry(i.to, k.to));
  return compose(compose(T_ai_bk, inverse(T_ak_bk)), along_odometry(k.from, i.from));
}

/// Squared Mahalanobis distance of the identity from T.
inline double distance_squared(const UncertainPose& T) {
  const Vector6 xi = se3_log(T.T);
  return xi.dot(T.Sigma.ldlt().solve(xi));
}

/// The same measurement given from the other side.
inline Closure reversed(const Closure& c) {
  const UncertainPose T_to_from = inverse(UncertainPose{c.T_from_to, c.covariance});
  return {c.to, c.from, T_to_from.T, T_to_from.Sigma, c.inliers, c.similarity};
}

/// Two robots whose true relation T_a_b is known, driving at random; measurements with noise that
/// has the covariance it says.
struct TwoRobots {
  Chain a, b;
  std::vector<SE3> T_world_a, T_world_b;  ///< Truth.

  TwoRobots(RobotId robot_a, RobotId robot_b, std::size_t poses, double sigma, std::mt19937& rng)
      : a(robot_a), b(robot_b) {
    drive(a, T_world_a, poses, sigma, rng);
    drive(b, T_world_b, poses, sigma, rng);
  }

  [[nodiscard]] Closure measure(std::size_t i, std::size_t j, double sigma,
                                std::mt19937& rng) const {
    const SE3 T_i_j = T_world_a[i].inverse() * T_world_b[j];
    return closure(a.at(i), b.at(j), noisy(T_i_j, sigma, rng), sigma * sigma);
  }

  static SE3 noisy(const SE3& T, double sigma, std::mt19937& rng) {
    return T * se3_exp(Vector6(sigma * random_vector<6>(rng)));
  }

 private:
  static void drive(Chain& chain, std::vector<SE3>& truth, std::size_t poses, double sigma,
                    std::mt19937& rng) {
    truth.push_back(random_pose(rng));
    while (truth.size() < poses) {
      const SE3 step = random_pose(rng, 1.0);
      truth.push_back(truth.back() * step);
      chain.step(noisy(step, sigma, rng), sigma * sigma);
    }
  }
};

}  // namespace km
