#pragma once

#include <memory>
#include <vector>

#include "modules/core/frame.hpp"

namespace km {

/// Gives up the images of packets that come too late, as a camera would overwrite them, and keeps
/// their inertial samples.
class LagFilter {
 public:
  /// Throws std::invalid_argument unless max_lag_s >= 0.
  explicit LagFilter(double max_lag_s);

  /// What to publish of a packet that is `lag_s` late: the packet, with the samples of those given
  /// up before it in front of its own; or null if it is given up itself.
  [[nodiscard]] std::shared_ptr<const SensorPacket> take(
      const std::shared_ptr<const SensorPacket>& packet, double lag_s);

 private:
  double max_lag_s_;
  std::vector<ImuSample> held_back_;  // of the packets given up since the last one taken
};

}  // namespace km
