#include "modules/pose_graph/round_ledger.hpp"

#include <cmath>
#include <limits>

namespace km {
namespace {

// Rounds that one member can be ahead of another it has no edge with; older shares are waited for.
constexpr std::size_t kMaxOpenRounds = 64;

}  // namespace

bool RoundLedger::record(RobotId robot, std::uint32_t round, double cost, double squared_gradient) {
  if (!members_.contains(robot) || (last_ && round <= last_->round)) return false;
  auto& shares = shares_[round];
  shares[robot] = {cost, squared_gradient};
  if (shares.size() < members_.size()) {
    if (shares_.size() > kMaxOpenRounds) shares_.erase(shares_.begin());
    return false;
  }
  Total total{.round = round};
  double squared = 0.0;
  for (const auto& [member, share] : shares) {
    total.cost += share.cost;
    squared += share.squared_gradient;
  }
  total.gradient_norm = std::sqrt(squared);
  if (last_)
    relative_decrease_ = (last_->cost - total.cost) / (round - last_->round) /
                         std::max(std::abs(total.cost), std::numeric_limits<double>::min());
  last_ = total;
  shares_.erase(shares_.begin(), shares_.upper_bound(round));
  return true;
}

}  // namespace km
