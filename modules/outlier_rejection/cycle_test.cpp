#include "modules/outlier_rejection/cycle_test.hpp"

#include <Eigen/Cholesky>
#include <tuple>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/outlier_rejection/chi_squared.hpp"
#include "modules/outlier_rejection/pair_cycle.hpp"

namespace km {
namespace {

// Added to the variances of a cycle, so that they are positive: (1e-6 rad)^2 and (1e-6 m)^2.
constexpr double kLeastVariance = 1e-12;

UncertainPose uncertain(const OdometryPose& pose) {
  return {pose.T_odom_kf, pose.covariance};
}

// T_from_to along one robot's odometry.
UncertainPose along_odometry(const OdometryPose& from, const OdometryPose& to) {
  if (from.id.index <= to.id.index) return between_on_chain(uncertain(from), uncertain(to));
  return inverse(between_on_chain(uncertain(to), uncertain(from)));
}

std::int64_t steps(const OdometryPose& from, const OdometryPose& to) {
  const auto begin = std::int64_t{from.id.index}, end = std::int64_t{to.id.index};
  return begin < end ? end - begin : begin - end;
}

bool before(const PreparedClosure& i, const PreparedClosure& k) {
  return std::tie(i.a, i.b, i.id) < std::tie(k.a, k.b, k.id);
}

}  // namespace

Cycle cycle_through(const OrientedClosure& i, const OrientedClosure& k) {
  const UncertainPose T_ai_bk = compose(i.T_a_b, along_odometry(i.b, k.b));
  const UncertainPose T_ai_ak = compose(T_ai_bk, inverse(k.T_a_b));
  return {compose(T_ai_ak, along_odometry(k.a, i.a)), 2 + steps(i.a, k.a) + steps(i.b, k.b)};
}

Cycle cycle_along_odometry(const OrientedClosure& closure) {
  return {compose(closure.T_a_b, along_odometry(closure.b, closure.a)),
          1 + steps(closure.a, closure.b)};
}

double distance_squared(const UncertainPose& T) {
  const Matrix6 Sigma = T.Sigma + kLeastVariance * Matrix6::Identity();
  const Vector6 xi = se3_log(T.T);
  return xi.dot(Sigma.ldlt().solve(xi));
}

CycleTest::CycleTest(const PcmConfig& config)
    : config_(checked(config)), max_distance_squared_(chi_squared_6_quantile(config.confidence)) {}

OrientedClosure CycleTest::orient(const Closure& closure) const {
  const double odometry = config_.odometry_noise_scale * config_.odometry_noise_scale;
  const double measured = config_.closure_noise_scale * config_.closure_noise_scale;
  OrientedClosure result{
      closure.id(), closure.from, closure.to, {closure.T_from_to, measured * closure.covariance}};
  if (result.b.id < result.a.id) {
    std::swap(result.a, result.b);
    result.T_a_b = inverse(result.T_a_b);
  }
  result.a.covariance *= odometry;
  result.b.covariance *= odometry;
  return result;
}

bool CycleTest::consistent(const PreparedClosure& i, const PreparedClosure& k) const {
  // First-order covariances depend slightly on the start of the cycle. A fixed start makes the
  // result symmetric.
  const PairCycle cycle = before(i, k) ? PairCycle(i, k) : PairCycle(k, i);
  if (config_.criterion == CycleCriterion::kMahalanobis)
    return cycle.within_distance(max_distance_squared_);
  return within_bounds(cycle.translation_m(), cycle.rotation_rad(), cycle.transforms());
}

std::vector<std::size_t> CycleTest::consistent_with(const PreparedClosure& closure,
                                                    std::span<const PreparedClosure> others) const {
  std::vector<std::size_t> numbers;
  for (std::size_t k = 0; k < others.size(); ++k)
    if (consistent(closure, others[k])) numbers.push_back(k);
  return numbers;
}

bool CycleTest::agrees_with_odometry(const OrientedClosure& closure) const {
  const Cycle cycle = cycle_along_odometry(closure);
  if (config_.criterion == CycleCriterion::kMahalanobis)
    return distance_squared(cycle.T) <= max_distance_squared_;
  return within_bounds(cycle.T.T.translation().norm(), angle_of(cycle.T.T.linear()),
                       cycle.transforms);
}

bool CycleTest::within_bounds(double translation_m, double rotation_rad,
                              std::int64_t transforms) const {
  const double factor = config_.bounds_per_transform ? static_cast<double>(transforms) : 1.0;
  return translation_m <= factor * config_.max_cycle_translation_m &&
         rotation_rad <= factor * config_.max_cycle_rotation_rad;
}

}  // namespace km
