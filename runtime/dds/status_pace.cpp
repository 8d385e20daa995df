#include "runtime/dds/status_pace.hpp"

#include <algorithm>

namespace km {

bool StatusPace::is_due(std::uint32_t awaited, std::size_t others) {
  constexpr auto kNewTicks = static_cast<std::size_t>(kNew_s / kStatusPeriod_s);
  const bool is_new = ticks_++ <= kNewTicks;
  const std::size_t period = std::max(kUsualTicks, (others + kPerTick - 1) / kPerTick);
  if (!is_new && awaited_ == awaited && ++since_sent_ < period) return false;
  since_sent_ = 0;
  awaited_ = awaited;
  return true;
}

}  // namespace km
