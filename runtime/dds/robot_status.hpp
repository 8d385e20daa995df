#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/team_links.hpp"
#include "runtime/dds/codec.hpp"
#include "runtime/dds/status_pace.hpp"
#include "runtime/node.hpp"
#include "runtime/overlay/overlay_summary.hpp"
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
struct Codec<RobotStatus> {
  using Wire = km_wire_RobotStatus;
  static constexpr const char* kTopic = "robot_status";
  static constexpr std::uint16_t kVersion = 1;
  static constexpr std::size_t kMaxBytes = 256 + 26 * kMaxTeam;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_RobotStatus_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_OverlayHeld> holds;
    std::vector<std::uint16_t> missed;
  };
  static MessageKey key_of(const RobotStatus& status);
  static Encoded encode(const RobotStatus& status);
  static Decoded<RobotStatus> decode(const Wire& wire, const TeamPeer& writer);
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
