#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// A symmetric 6x6 matrix, tangent [rotation; translation], as its three independent blocks:
/// [rr rt; rt^T tt]. A transform into another frame takes a third of the time that it takes with
/// Matrix6.
struct BlockCovariance {
  Eigen::Matrix3d rr = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d rt = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d tt = Eigen::Matrix3d::Zero();

  BlockCovariance() = default;
  /// Precondition: `Sigma` is symmetric.
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

/// Quantities of a closure that all cycles through it use, computed once.
///
/// Expressed in odom_a, the frame in which robot a's odometry began, covariances do not depend on
/// the rest of the cycle. The covariance of the odometry between two keyframes is the difference of
/// the covariances accumulated at each.
struct PreparedClosure {
  /// `closure` is from a to b, as CycleTest::orient() returns it.
  explicit PreparedClosure(const Closure& closure);

  ClosureId id;
  KeyframeId a, b;
  SE3 T_odoma_odomb;           ///< Transform between the odometry frames, by this closure.
  BlockCovariance odometry_a;  ///< Covariance accumulated at a, expressed in odom_a.
  BlockCovariance odometry_b;  ///< Covariance accumulated at b, expressed in odom_b.
  BlockCovariance measured;    ///< Covariance of the closure, at b, expressed in odom_a.
};

/// True if the squared Mahalanobis distance between the identity and the cycle through two closures
/// between the same robots is at most `max_distance_squared`. The cycle leads from keyframe a_i
/// along closure i, the odometry of b, closure k reversed and the odometry of a. It is expressed in
/// odom_a.
[[nodiscard]] bool closes_within(const PreparedClosure& i, const PreparedClosure& k,
                                 double max_distance_squared);

/// Tests closures between two robots, or inside one, for pairwise consistency: the cycle
///     T_ai_bi * T_bi_bk * T_bk_ak * T_ak_ai
/// along closure i, the odometry of b, closure k reversed and the odometry of a must be the
/// identity up to noise (Mangelson et al., "Pairwise Consistent Measurement Set Maximization for
/// Robust Multi-Robot Map Merging", ICRA 2018). The test composes the covariances of
/// both closures and of both stretches of odometry along the cycle, as LAMP does (Ebadi et al.,
/// ICRA 2020, Sec. II-E). The four are assumed to be independent. Inside one robot they are not if
/// the stretches overlap.
class CycleTest {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit CycleTest(const PcmConfig& config);

  /// The closure from its lower keyframe, inverted if necessary, because a cycle does not depend on
  /// the direction. Covariances are multiplied by the squared noise scales of the test.
  /// Precondition: its two ends differ.
  [[nodiscard]] Closure orient(const Closure& closure) const;

  /// True if the cycle through both closures is consistent. Symmetric in i and k. Precondition:
  /// both are between the same robots.
  [[nodiscard]] bool consistent(const PreparedClosure& i, const PreparedClosure& k) const;

  /// Indices of the `others` that are consistent with `closure`, ascending.
  [[nodiscard]] std::vector<std::size_t> consistent_with(
      const PreparedClosure& closure, std::span<const PreparedClosure> others) const;

 private:
  PcmConfig config_;
  double max_distance_squared_;
};

}  // namespace km
