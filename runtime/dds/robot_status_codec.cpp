#include "runtime/dds/robot_status_codec.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace km {

const char* to_string(RobotPhase phase) {
  switch (phase) {
    case RobotPhase::kRunning:
      return "running";
    case RobotPhase::kFinished:
      return "finished";
    case RobotPhase::kSettled:
      return "settled";
    case RobotPhase::kLeaving:
      break;
  }
  return "leaving";
}

Codec<RobotStatus>::Encoded Codec<RobotStatus>::encode(const RobotStatus& status) {
  Encoded encoded;
  Wire& wire = encoded.wire;
  wire.robot = status.robot;
  const std::size_t length = std::min(status.name.size(), sizeof wire.name - 1);
  std::memcpy(wire.name, status.name.data(), length);
  wire.phase = static_cast<km_wire_Phase>(status.phase);
  wire.dataset_time_s = status.dataset_time_s;
  wire.keyframes = status.keyframes;
  wire.settled_links = status.settled_links;
  return encoded;
}

Decoded<RobotStatus> Codec<RobotStatus>::decode(const Wire& wire) {
  using Result = Decoded<RobotStatus>;
  const std::size_t length = strnlen(wire.name, sizeof wire.name);
  const std::string name(wire.name, length);
  const auto printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (wire.robot != wire.header.robot) return Result::refuse("status of another robot");
  if (!std::ranges::all_of(name, printable)) return Result::refuse("name is not printable");
  if (wire.phase > km_wire_PHASE_LEAVING) return Result::refuse("unknown phase");
  if (!std::isfinite(wire.dataset_time_s)) return Result::refuse("time is not finite");
  const auto phase = static_cast<RobotPhase>(wire.phase);
  return Result::accept({wire.robot, name, phase, wire.dataset_time_s, wire.keyframes,
                         wire.settled_links});
}

}  // namespace km
