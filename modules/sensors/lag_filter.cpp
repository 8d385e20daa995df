#include "modules/sensors/lag_filter.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

// The first sample of a packet repeats the last of the one before.
void append(std::vector<ImuSample>& samples, const std::vector<ImuSample>& next) {
  const bool repeats = !samples.empty() && !next.empty() && next[0].stamp == samples.back().stamp;
  samples.insert(samples.end(), next.begin() + (repeats ? 1 : 0), next.end());
}

}  // namespace

LagFilter::LagFilter(double max_lag_s) : max_lag_s_(max_lag_s) {
  if (!(max_lag_s >= 0.0))
    throw std::invalid_argument("LagFilter: max_lag_s " + std::to_string(max_lag_s) +
                                " is negative");
}

std::shared_ptr<const SensorPacket> LagFilter::take(
    const std::shared_ptr<const SensorPacket>& packet, double lag_s) {
  if (lag_s > max_lag_s_) {
    append(held_back_, packet->imu);
    return nullptr;
  }
  if (held_back_.empty()) return packet;
  auto joined =
      std::make_shared<SensorPacket>(SensorPacket{packet->frame, std::exchange(held_back_, {})});
  append(joined->imu, packet->imu);
  return joined;
}

}  // namespace km
