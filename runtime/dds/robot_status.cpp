#include "runtime/dds/robot_status.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

namespace km {
namespace {

// The phase and settled_links, for which other robots wait, as one number.
std::uint32_t awaited_of(const RobotStatus& status) {
  return 256U * static_cast<std::uint32_t>(status.phase) + status.settled_links;
}

}  // namespace

const char* to_string(RobotPhase phase) {
  constexpr std::array kNames = {"running", "finished", "settled", "leaving"};
  return kNames.at(static_cast<std::size_t>(phase));
}

MessageKey Codec<RobotStatus>::key_of(const RobotStatus& /*status*/) {
  return message_key({});
}

Codec<RobotStatus>::Encoded Codec<RobotStatus>::encode(const RobotStatus& status) {
  Encoded encoded;
  Wire& wire = encoded.wire;
  const std::size_t length = std::min(status.name.size(), sizeof wire.name - 1);
  std::memcpy(wire.name, status.name.data(), length);
  wire.phase = static_cast<km_wire_Phase>(status.phase);
  wire.dataset_time_s = status.dataset_time_s;
  wire.keyframes = status.keyframes;
  wire.settled_links = status.settled_links;
  wire.states = status.overlay.states;
  for (const auto& [origin, bags, reliable] : status.overlay.holds)
    encoded.holds.push_back({origin.robot, origin.boot, bags, reliable});
  borrow(wire.holds, encoded.holds);
  wire.own_states = status.overlay.own_states;
  encoded.missed = status.overlay.missed;
  borrow(wire.missed, encoded.missed);
  return encoded;
}

Decoded<RobotStatus> Codec<RobotStatus>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<RobotStatus>;
  const std::size_t length = strnlen(wire.name, sizeof wire.name);
  const std::string name(wire.name, length);
  const auto printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (!std::ranges::all_of(name, printable)) return Result::refuse("name is not printable");
  if (wire.phase > km_wire_PHASE_LEAVING) return Result::refuse("unknown phase");
  if (!std::isfinite(wire.dataset_time_s)) return Result::refuse("time is not finite");
  const auto holds = elements_of(wire.holds, kMaxTeam);
  const auto missed = elements_of(wire.missed, kMaxTeam);
  if (!holds || !missed) return Result::refuse("it names too many robots");
  OverlaySummary overlay{.states = wire.states,
                         .own_states = wire.own_states,
                         .missed = {missed->begin(), missed->end()}};
  for (const km_wire_OverlayHeld& held : *holds)
    overlay.holds.push_back({{held.robot, held.boot}, held.bags, held.reliable});
  const auto phase = static_cast<RobotPhase>(wire.phase);
  return Result::accept({writer.robot, name, phase, wire.dataset_time_s, wire.keyframes,
                         wire.settled_links, writer.boot, std::move(overlay)});
}

RobotStatusNode::RobotStatusNode(std::function<RobotStatus()> provider,
                                 const RobotStatusTopics& topics)
    : periodic_(
          std::chrono::duration_cast<std::chrono::nanoseconds>(
              std::chrono::duration<double>(kStatusPeriod_s)),
          [this, provider = std::move(provider), own = topics.own, pace = StatusPace()]() mutable {
            const RobotStatus status = provider();
            if (pace.is_due(awaited_of(status), heard_robots())) own.publish(status);
          },
          "robot_status") {
  topics.peers.subscribe([this](const Topic<RobotStatus>::Message& status) {
    const std::lock_guard lock(mutex_);
    latest_[status->robot] = *status;
  });
}

std::size_t RobotStatusNode::heard_robots() const {
  const std::lock_guard lock(mutex_);
  return latest_.size();
}

std::vector<RobotStatus> RobotStatusNode::peers() const {
  const std::lock_guard lock(mutex_);
  std::vector<RobotStatus> result;
  for (const auto& [robot, status] : latest_) result.push_back(status);
  return result;
}

}  // namespace km
