#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/doctor/examine.hpp"
#include "apps/robot/peer_echo.hpp"
#include "modules/diagnosis/finding.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/robot_identity.hpp"

namespace km {

/// A robot of the team that DDS discovered, or a program that announces itself as one.
struct DiscoveredRobot {
  std::string address = {};                    ///< As DDS states it: "udp/10.0.0.2:7411".
  std::optional<RobotIdentity> identity = {};  ///< Absent if its announcement is not readable.
  bool has_keys = false;
  double unanswered_s = 0.0;  ///< Time for which it was heard, without an answer; 0: it answers.
};

/// Offset of the wall clock of a robot from the clock of this host. It is the least difference over
/// the robot's messages, so its error is at most the least transmission time.
struct ClockDifference {
  std::string robot;
  double ahead_s = 0.0;  ///< Positive if the clock of the robot is ahead [s].
};

/// Source of announcements that this host's robots do not receive.
struct Elsewhere {
  int domain = 0;
  std::string interface;

  auto operator<=>(const Elsewhere&) const = default;
};

/// Facts about the network that are found without taking part in a session.
struct NetworkFacts {
  DdsConfig config = {};
  std::vector<NetworkInterface> interfaces = {};
  std::optional<NetworkInterface> chosen = {};
  std::string no_interface = {};  ///< Reason why no interface was chosen.
  /// Reason why a test datagram to the group of discovery was not received.
  std::optional<std::string> no_multicast = {};
  /// Reason why a test datagram to the own address was not received.
  std::optional<std::string> no_unicast = {};
  std::optional<long> largest_receive_buffer = {};  ///< net.core.rmem_max [B].
  std::vector<DiscoveredRobot> robots = {};  ///< Found on the domain and in the team of `config`.
  /// Addresses that announce themselves to DDS discovery on other domains up to kLastQuietDomain,
  /// or on the own one on another interface.
  std::map<Elsewhere, std::set<std::string>> elsewhere = {};
  std::size_t ros_topics = 0;  ///< Topics of ROS 2 on the domain of `config`.
  double listened_s = 0.0;
  std::vector<PeerEcho> echoes = {};
  std::vector<ClockDifference> clocks = {};
};

/// Examines the network of `config` for `listen_s` [s], without taking part in a session. The
/// function sends datagrams to its own host, by multicast and by address, and echo requests to the
/// peers. A participant that is no robot discovers the robots on the domain of `config`. Throws
/// DdsError if DDS refuses the configuration.
[[nodiscard]] NetworkFacts probe_network(const DdsConfig& config, double listen_s,
                                         const ReportProgress& report_progress);

/// Findings on the facts; the README lists them.
[[nodiscard]] Examination examine_network(const NetworkFacts& facts);

}  // namespace km
