#include "runtime/dds/status_pace.hpp"

#include <algorithm>

namespace km {

bool StatusPace::is_due(const RobotStatus& status, std::size_t others) {
  constexpr auto kNewTicks = static_cast<std::size_t>(kNew_s / kStatusPeriod_s);
  const bool is_new = ticks_++ <= kNewTicks;
  const bool changed = phase_ != status.phase || settled_links_ != status.settled_links;
  const std::size_t period = std::max<std::size_t>(1, (others + kFullRate - 1) / kFullRate);
  if (!is_new && !changed && ++since_sent_ < period) return false;
  since_sent_ = 0;
  phase_ = status.phase;
  settled_links_ = status.settled_links;
  return true;
}

}  // namespace km
