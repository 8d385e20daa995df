#include "modules/outlier_rejection/cycle_test.hpp"

#include <Eigen/Cholesky>
#include <tuple>
#include <utility>

#include "modules/outlier_rejection/chi_squared.hpp"

namespace km {
namespace {

// Added to the variances of a closure, so that they are positive: (1e-6 rad)^2 and (1e-6 m)^2.
constexpr double kLeastClosureVariance = 1e-12;

// Covariance that odometry accumulates between two keyframes of a chain, in any common frame.
BlockCovariance added(const KeyframeId& i, const BlockCovariance& at_i, const KeyframeId& k,
                      const BlockCovariance& at_k) {
  return i.index < k.index ? at_k - at_i : at_i - at_k;
}

bool before(const PreparedClosure& i, const PreparedClosure& k) {
  return std::tie(i.a, i.b, i.id) < std::tie(k.a, k.b, k.id);
}

}  // namespace

PreparedClosure::PreparedClosure(const Closure& closure)
    : id(closure.id()),
      a(closure.from.id),
      b(closure.to.id),
      T_odoma_odomb(closure.from.T_odom_kf * closure.T_from_to * closure.to.T_odom_kf.inverse()),
      odometry_a(transported(closure.from.T_odom_kf, BlockCovariance(closure.from.covariance))),
      odometry_b(transported(closure.to.T_odom_kf, BlockCovariance(closure.to.covariance))),
      measured(transported(
          closure.from.T_odom_kf * closure.T_from_to,
          BlockCovariance(closure.covariance + kLeastClosureVariance * Matrix6::Identity()))) {}

bool closes_within(const PreparedClosure& i, const PreparedClosure& k,
                   double max_distance_squared) {
  const SE3 T = i.T_odoma_odomb * k.T_odoma_odomb.inverse();
  const Eigen::Matrix3d R = T.linear(), R_k = k.T_odoma_odomb.linear();
  const BlockCovariance along_a = added(i.a, i.odometry_a, k.a, k.odometry_a);
  const BlockCovariance along_b = added(i.b, i.odometry_b, k.b, k.odometry_b);

  // The distance of the rotation alone is at most that of the cycle, and rejects most outliers.
  const Eigen::Vector3d phi = so3_log(R);
  const Eigen::Matrix3d rr = R.transpose() * i.measured.rr * R +
                             R_k * along_b.rr * R_k.transpose() + k.measured.rr + along_a.rr;
  const Eigen::LLT<Eigen::Matrix3d> L_rr(rr);
  if (L_rr.info() != Eigen::Success) return false;
  const Eigen::Vector3d y_r = L_rr.matrixL().solve(phi);
  if (!(y_r.squaredNorm() <= max_distance_squared)) return false;

  BlockCovariance Sigma = transported(T.inverse(), i.measured);
  Sigma += transported(k.T_odoma_odomb, along_b);
  Sigma += k.measured;
  Sigma += along_a;
  const Eigen::Vector3d rho = so3_right_jacobian_inverse(-phi) * T.translation();
  // Cholesky factorisation of Sigma by blocks.
  const Eigen::Matrix3d W = L_rr.matrixL().solve(Sigma.rt);
  const Eigen::LLT<Eigen::Matrix3d> L_tt(Sigma.tt - W.transpose() * W);
  if (L_tt.info() != Eigen::Success) return false;
  const Eigen::Vector3d y_t = L_tt.matrixL().solve(rho - W.transpose() * y_r);
  return y_r.squaredNorm() + y_t.squaredNorm() <= max_distance_squared;
}

CycleTest::CycleTest(const PcmConfig& config)
    : config_(checked(config)), max_distance_squared_(chi_squared_6_quantile(config.confidence)) {}

Closure CycleTest::orient(const Closure& closure) const {
  Closure result = closure;
  result.covariance *= config_.closure_noise_scale * config_.closure_noise_scale;
  if (result.to.id < result.from.id) {
    std::swap(result.from, result.to);
    const UncertainPose T_from_to = inverse({result.T_from_to, result.covariance});
    result.T_from_to = T_from_to.T;
    result.covariance = T_from_to.Sigma;
  }
  for (OdometryPose* end : {&result.from, &result.to})
    end->covariance *= config_.odometry_noise_scale * config_.odometry_noise_scale;
  return result;
}

bool CycleTest::consistent(const PreparedClosure& i, const PreparedClosure& k) const {
  // First-order covariances depend slightly on the start of the cycle. A fixed start makes the
  // result symmetric.
  return before(i, k) ? closes_within(i, k, max_distance_squared_)
                      : closes_within(k, i, max_distance_squared_);
}

std::vector<std::size_t> CycleTest::consistent_with(const PreparedClosure& closure,
                                                    std::span<const PreparedClosure> others) const {
  std::vector<std::size_t> numbers;
  for (std::size_t k = 0; k < others.size(); ++k)
    if (consistent(closure, others[k])) numbers.push_back(k);
  return numbers;
}

}  // namespace km
