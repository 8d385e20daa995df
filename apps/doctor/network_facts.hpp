#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/diagnosis/examination.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/robot_identity.hpp"

namespace km {

/// A DDS participant by its announcement.
struct AnnouncedParticipant {
  /// GUID prefix of the participant's process; zero if unknown.
  std::array<std::uint8_t, 12> guid_prefix = {};
  int domain = 0;
  std::string team = {};                       ///< Domain tag of the team.
  std::string from = {};                       ///< Address of the sender.
  std::string user_data = {};                  ///< User data as received; often empty for programs
                                               ///< that are no robots.
  std::optional<RobotIdentity> identity = {};  ///< Identity of a robot with readable user data.
};

/// The participant that a packet of DDS discovery announces; nullopt for other bytes. `from`:
/// address of the sender. `domain`: domain of the socket that received the packet. RTPS 2.5, 8.5.3
/// and 9.6.3.2 (SPDPdiscoveredParticipantData).
[[nodiscard]] std::optional<AnnouncedParticipant> parse_announcement(
    const std::vector<std::uint8_t>& packet, int domain, const std::string& from);

/// Result of echo requests to a peer.
struct PeerEcho {
  std::string host;
  std::size_t sent = 0, received = 0;
  double median_s = 0.0, worst_s = 0.0;  ///< Round trip time; NaN without a reply.
  bool may_send_icmp = true;             ///< False if this user has no permission for ICMP.
};

/// Offset of the wall clock of a robot from the clock of this host. It is the least difference over
/// the robot's messages, so its error is at most the least transmission time.
struct ClockDifference {
  std::string robot;
  double ahead_s = 0.0;  ///< Positive if the clock of the robot is ahead [s].
};

/// Facts about the network that are found without taking part in a session.
struct NetworkFacts {
  DdsConfig config = {};
  std::vector<NetworkInterface> interfaces = {};
  std::optional<NetworkInterface> chosen = {};
  std::string no_interface = {};  ///< Reason why no interface was chosen.
  std::optional<int> mtu = {};
  std::optional<std::string> no_multicast =
      {};  ///< Reason why an own datagram to the group did not come back.
  std::optional<std::string> no_unicast =
      {};  ///< Reason why an own datagram to the own address did not come back.
  std::optional<long> largest_receive_buffer = {};   ///< net.core.rmem_max [B].
  std::vector<AnnouncedParticipant> announced = {};  ///< Participants on all domains up to
                                                     ///< kLastQuietDomain.
  std::vector<AnnouncedParticipant> received = {};   ///< Participants that DDS itself receives as
                                                     ///< configured, also by address.
  double listened_s = 0.0;
  std::vector<PeerEcho> echoes = {};
  std::vector<ClockDifference> clocks = {};
};

/// Findings on the facts. Ids: network.interface, network.several_interfaces, network.loopback,
/// network.no_multicast_flag,
/// network.multicast, network.firewall, network.mtu, network.buffers, network.domain_ports,
/// network.other_domain, network.other_team, network.protocol, network.same_id,
/// network.other_programs, `network.no_peers`, network.unreachable, network.loss, network.slow,
/// network.clock.
[[nodiscard]] Examination examine_network(const NetworkFacts& facts);

}  // namespace km
