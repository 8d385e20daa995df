#pragma once

#include <cstdint>

#include "modules/core/covariance.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/lie.hpp"
#include "modules/core/pose_graph.hpp"

namespace km {

/// A symmetric 6x6 matrix, tangent [rotation; translation], as its three independent blocks: [rr
/// rt; rt^T tt]. Transforming it into another frame costs a third of the same operation with
/// Matrix6.
struct BlockCovariance {
  Eigen::Matrix3d rr = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d rt = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d tt = Eigen::Matrix3d::Zero();

  BlockCovariance() = default;
  /// Assumes that the lower left block of `Sigma` is the transpose of the upper right one.
  explicit BlockCovariance(const Matrix6& Sigma)
      : rr(Sigma.topLeftCorner<3, 3>()),
        rt(Sigma.topRightCorner<3, 3>()),
        tt(Sigma.bottomRightCorner<3, 3>()) {}

  [[nodiscard]] Matrix6 matrix() const {
    Matrix6 Sigma;
    Sigma << rr, rt, rt.transpose(), tt;
    return Sigma;
  }

  BlockCovariance& operator+=(const BlockCovariance& other) {
    rr += other.rr;
    rt += other.rt;
    tt += other.tt;
    return *this;
  }
  friend BlockCovariance operator-(const BlockCovariance& x, const BlockCovariance& y) {
    BlockCovariance difference;
    difference.rr = x.rr - y.rr;
    difference.rt = x.rt - y.rt;
    difference.tt = x.tt - y.tt;
    return difference;
  }
};

/// adjoint(T) * Sigma * adjoint(T)^T.
[[nodiscard]] inline BlockCovariance transported(const SE3& T, const BlockCovariance& Sigma) {
  const Eigen::Matrix3d R = T.linear();
  const Eigen::Matrix3d K = skew(T.translation());
  const Eigen::Matrix3d B = R * Sigma.rt * R.transpose();
  BlockCovariance moved;
  moved.rr = R * Sigma.rr * R.transpose();
  moved.rt = B - moved.rr * K;  // K^T = -K
  const Eigen::Matrix3d KB = K * B;
  moved.tt = R * Sigma.tt * R.transpose() + KB + KB.transpose() - K * moved.rr * K;
  return moved;
}

/// A closure oriented so that a.id < b.id, because the direction of its measurement does not matter
/// to a cycle. Covariances are multiplied by the noise scales of the test.
struct OrientedClosure {
  ClosureId id;
  OdometryPose a;
  OdometryPose b;
  UncertainPose T_a_b;
};

/// Quantities of a closure that all cycles through it use, computed once.
///
/// Expressed in odom_a, where robot a began, covariances do not depend on the rest of the cycle.
/// The covariance of the closure is one matrix. The covariance of the odometry between two
/// keyframes is the difference of the covariances accumulated at each.
struct PreparedClosure {
  explicit PreparedClosure(const OrientedClosure& closure);

  ClosureId id;
  KeyframeId a, b;
  Eigen::Vector3d t_odoma_a;
  SE3 T_odoma_odomb;           ///< Start of b's odometry according to this closure.
  BlockCovariance odometry_a;  ///< Covariance accumulated at a, expressed in odom_a.
  BlockCovariance odometry_b;  ///< Covariance accumulated at b, expressed in odom_b.
  BlockCovariance measured;    ///< Covariance of the closure, at b, expressed in odom_a.
};

/// The cycle through two closures between the same robots. From ai it follows closure i, the
/// odometry of b, closure k reversed and the odometry of a. It is expressed in odom_a, where it
/// begins and ends.
class PairCycle {
 public:
  /// Borrows both.
  PairCycle(const PreparedClosure& i, const PreparedClosure& k);

  /// True if the squared Mahalanobis distance of the identity from the cycle is at most the given.
  [[nodiscard]] bool within_distance(double max_distance_squared) const;

  [[nodiscard]] double translation_m() const;  ///< Length of the cycle's, as ai sees it.
  [[nodiscard]] double rotation_rad() const;
  [[nodiscard]] std::int64_t transforms() const;  ///< Odometry steps and closures.

 private:
  [[nodiscard]] BlockCovariance covariance() const;

  const PreparedClosure& i_;
  const PreparedClosure& k_;
  SE3 T_;
};

}  // namespace km
