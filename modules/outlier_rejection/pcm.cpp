#include "modules/outlier_rejection/pcm.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr double kOrthonormal = 1e-6;  // entries of R^T R

}  // namespace

bool is_usable(const Closure& closure) {
  return closure.from.id != closure.to.id && is_rigid(closure.from.T_odom_kf, kOrthonormal) &&
         is_rigid(closure.to.T_odom_kf, kOrthonormal) &&
         is_rigid(closure.T_from_to, kOrthonormal) && is_covariance(closure.from.covariance) &&
         is_covariance(closure.to.covariance) && is_covariance(closure.covariance);
}

void check_usable(const Closure& closure, RobotId a, RobotId b) {
  const auto [low, high] = std::minmax(closure.from.id.robot, closure.to.id.robot);
  if (low != a || high != b || !is_usable(closure))
    throw std::invalid_argument("closure " + to_string(closure.from.id) + " -> " +
                                to_string(closure.to.id) + " is malformed or not between robots " +
                                std::to_string(a) + " and " + std::to_string(b));
}

Pcm::Pcm(RobotId a, RobotId b, const PcmConfig& config)
    : a_(std::min(a, b)),
      b_(std::max(a, b)),
      config_(checked(config)),
      test_(config),
      clique_(MaxClique::kMaxSearchNodes) {}

PcmAddResult Pcm::add(const Closure& closure) {
  check_usable(closure, a_, b_);
  if (known_.contains(closure.id())) return PcmAddResult::kRepeated;
  if (known_.size() >= kMaxClosures) return PcmAddResult::kFull;
  known_.insert(closure.id());

  PreparedClosure added(test_.orient(closure));
  const std::vector<std::size_t> consistent = test_.consistent_with(added, closures_);
  closures_.push_back(std::move(added));
  return clique_.add(consistent) ? PcmAddResult::kGrew : PcmAddResult::kAdded;
}

std::vector<ClosureId> Pcm::inliers() const {
  std::vector<ClosureId> ids;
  if (clique_.clique().size() < static_cast<std::size_t>(config_.min_inliers)) return ids;
  for (const std::size_t i : clique_.clique()) ids.push_back(closures_[i].id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace km
