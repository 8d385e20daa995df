#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace km {

/// Shortest interval between statuses of a robot [s].
inline constexpr double kStatusPeriod_s = 0.5;

/// Decides at each tick, every kStatusPeriod_s, whether a robot sends its status. It is due once a
/// second, which is 2 ticks, and in a team with N other robots every ceil(N / kPerTick) ticks if
/// that is longer. The statuses that a robot receives in a second then do not grow with a large
/// team. A status is also due at once if what other robots wait for has changed. In the first
/// kNew_s every status is due: a process with the same robot id reads the uptime from their number,
/// see PeerTable::twin_received(). Not thread-safe.
class StatusPace {
 public:
  static constexpr std::size_t kUsualTicks = 2;
  static constexpr std::size_t kPerTick = 5;  ///< Statuses of large teams in a tick.
  static constexpr double kNew_s = 10.0;

  /// To be called once per tick. `awaited`: any number that changes with what others wait for.
  /// `others`: number of other robots whose statuses have arrived.
  [[nodiscard]] bool is_due(std::uint32_t awaited, std::size_t others) {
    constexpr auto kNewTicks = static_cast<std::size_t>(kNew_s / kStatusPeriod_s);
    const bool is_new = ticks_++ <= kNewTicks;
    const std::size_t period = std::max(kUsualTicks, (others + kPerTick - 1) / kPerTick);
    if (!is_new && awaited_ == awaited && ++since_sent_ < period) return false;
    since_sent_ = 0;
    awaited_ = awaited;
    return true;
  }

 private:
  std::size_t ticks_ = 0;
  std::size_t since_sent_ = 0;  // ticks
  std::optional<std::uint32_t> awaited_;
};

}  // namespace km
