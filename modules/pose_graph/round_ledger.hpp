#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "modules/core/ids.hpp"

namespace km {

/// Sums of the members' shares for rounds that all of them have finished. Shares may come in any
/// order and repeatedly, and some may never come: such a round is passed over.
class RoundLedger {
 public:
  struct Total {
    std::uint32_t round = 0;
    double cost = 0.0;
    double gradient_norm = 0.0;
  };

  explicit RoundLedger(std::set<RobotId> members) : members_(std::move(members)) {}

  /// True if this share completed a round later than the last complete one.
  bool record(RobotId robot, std::uint32_t round, double cost, double squared_gradient);

  [[nodiscard]] const std::optional<Total>& last() const { return last_; }
  /// Decrease per round between the last two complete rounds, over the cost; nullopt before there
  /// are two.
  [[nodiscard]] std::optional<double> relative_decrease() const { return relative_decrease_; }

 private:
  struct Share {
    double cost = 0.0;
    double squared_gradient = 0.0;
  };

  std::set<RobotId> members_;
  std::map<std::uint32_t, std::map<RobotId, Share>> shares_;
  std::optional<Total> last_;
  std::optional<double> relative_decrease_;
};

}  // namespace km
