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

/// How much a robot may still send, see BudgetConfig. A message goes while there is no debt,
/// however large it is: the next ones wait until it is paid. So in any time of t seconds go
/// bytes_per_s * (t + kBurst_s) and one message at most.
/// Pure: time comes in [s], any origin, and does not go backwards. Not thread-safe.
class SendBudget {
 public:
  /// Amount that may be sent at once after a silence, in seconds of the limit.
  static constexpr double kBurst_s = 0.2;

  /// Throws ConfigError if `config` is out of bounds.
  explicit SendBudget(const BudgetConfig& config);

  /// How long after `now_s` a message of `bytes` may go to each of `readers`; nullopt: never, for
  /// what its priority may take of the run's total is used up. Presence may always.
  [[nodiscard]] std::optional<double> wait_s(SendPriority priority, std::uint64_t bytes,
                                             std::span<const RobotId> readers, double now_s);

  /// Such a message goes.
  void spend(SendPriority priority, std::uint64_t bytes, std::span<const RobotId> readers,
             double now_s);

  /// The sum of all that has gone, as counted elsewhere: what was sent without asking, or again, is
  /// spent now.
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
