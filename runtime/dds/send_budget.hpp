#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "modules/core/ids.hpp"
#include "runtime/dds/budget_config.hpp"
#include "runtime/dds/send_priority.hpp"
#include "runtime/token_bucket.hpp"

namespace km {

/// Amount that a robot may still send, see BudgetConfig. A message is sent if there is no debt,
/// however large the message is: the next ones wait until the debt is paid. So in any time of t
/// seconds at most bytes_per_s * (t + kBurst_s) and one message are sent. Deterministic: time comes
/// in [s], with any origin, and does not decrease. Not thread-safe.
class SendBudget {
 public:
  /// Amount that may be sent at once after a silence, in seconds of the limit.
  static constexpr double kBurst_s = 0.2;

  /// Throws ConfigError if `config` is out of bounds.
  explicit SendBudget(const BudgetConfig& config);

  /// Time after `now_s` until a message of `bytes` may be sent to each of `readers`. nullopt:
  /// never, because its priority has used up its share of the run's total. Presence may always be
  /// sent.
  [[nodiscard]] std::optional<double> wait_s(SendPriority priority, std::uint64_t bytes,
                                             std::span<const RobotId> readers, double now_s);

  /// Charges the budget for one copy of a message per reader: bytes * readers.size().
  void charge(SendPriority priority, std::uint64_t bytes, std::span<const RobotId> readers,
              double now_s);

  /// Updates the sum of all sent bytes, which is counted elsewhere: bytes that DDS has sent by
  /// itself, or again, are charged now.
  void settle(std::uint64_t sent_bytes, double now_s);

 private:
  using Limit = std::optional<TokenBucket>;
  [[nodiscard]] Limit& limit_of(SendPriority priority);

  const BudgetConfig config_;
  Limit all_;
  std::array<Limit, kSendPriorities> of_priority_;
  std::map<RobotId, TokenBucket> of_peer_;
  std::uint64_t spent_bytes_ = 0;
};

}  // namespace km
