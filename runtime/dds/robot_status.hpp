#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/data/team_links.hpp"
#include "modules/core/ids.hpp"
#include "runtime/dds/codec.hpp"
#include "runtime/node.hpp"
#include "runtime/overlay/overlay_message.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"
#include "status.h"

namespace km {

/// kFinished: its input has ended. kSettled: additionally, its pose graph does not change any more.
/// kLeaving: about to end.
enum class RobotPhase { kRunning, kFinished, kSettled, kLeaving };

/// "running", "finished", "settled", "leaving".
const char* to_string(RobotPhase phase);

/// State that a robot sends to the others at the StatusPace.
struct RobotStatus {
  RobotId robot = 0;
  std::string name;
  RobotPhase phase = RobotPhase::kRunning;
  double dataset_time_s = 0.0;  ///< Time since the start of the robot's input.
  std::uint32_t keyframes = 0;
  /// All robots fewer than this number of links away have settled; 0: this robot has not settled.
  /// It is one more than the smallest number of the neighbours, so robots also wait for distant
  /// robots.
  std::uint8_t settled_links = 0;
  std::uint64_t boot = 0;  ///< Boot id of the sending process.
  OverlaySummary overlay = {};
};

/// Largest value of settled_links, which also stands for larger numbers of links.
inline constexpr std::uint8_t kMaxSettledLinks = 255;

template <>
struct Codec<RobotStatus> : WireFormat<km_wire_RobotStatus, km_wire_RobotStatus_desc> {
  static constexpr const char* kTopic = "robot_status";
  static constexpr std::size_t kMaxBytes = 256 + 26 * kMaxTeam;

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_OverlayHeld> holds;
    std::vector<std::uint16_t> missed;
  };
  static MessageKey key_of(const RobotStatus& status);
  static Encoded encode(const RobotStatus& status);
  static Decoded<RobotStatus> decode(const Wire& wire, const TeamPeer& writer);
};

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

/// Channels of the status node; they must outlive it.
struct RobotStatusTopics {
  Out<RobotStatus> own;
  In<RobotStatus> peers;
};

/// Publishes this robot's status at the StatusPace and keeps the latest of each peer. Both
/// topics cross as kStatus: they carry the presence of the robots.
class RobotStatusNode final : public Node {
 public:
  /// `provider` is called on this node's thread.
  RobotStatusNode(std::function<RobotStatus()> provider, const RobotStatusTopics& topics);

  /// Latest status of each known robot, ascending by id. Thread-safe.
  [[nodiscard]] std::vector<RobotStatus> peers() const;

  std::string_view name() const override { return "robot_status"; }
  void start() override { periodic_.start(); }
  void stop() noexcept override { periodic_.stop(); }
  std::exception_ptr error() const override { return periodic_.error(); }

 private:
  [[nodiscard]] std::size_t heard_robots() const;

  mutable std::mutex mutex_;  // guards latest_
  std::map<RobotId, RobotStatus> latest_;
  Periodic periodic_;  // last member: stops first
};

}  // namespace km
