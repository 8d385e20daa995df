#include "modules/outlier_rejection/cycle_test.hpp"

#include <tuple>
#include <utility>

#include "modules/outlier_rejection/chi_squared.hpp"

namespace km {
namespace {

bool before(const PreparedClosure& i, const PreparedClosure& k) {
  return std::tie(i.a, i.b, i.id) < std::tie(k.a, k.b, k.id);
}

}  // namespace

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
