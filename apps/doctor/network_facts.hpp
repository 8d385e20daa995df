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

/// A DDS participant as it announces itself on the link.
struct Announced {
  /// Of its process; zero where it is not known.
  std::array<std::uint8_t, 12> guid_prefix = {};
  int domain = 0;
  std::string team = {};                       ///< Its domain tag.
  std::string from = {};                       ///< Address.
  std::string user_data = {};                  ///< As it came; empty of other programs.
  std::optional<RobotIdentity> identity = {};  ///< Of a robot whose user data can be read.
};

/// What a packet of DDS discovery announces; nullopt for bytes that are none. `from`, `domain`: of
/// the socket that it came from. RTPS 2.5, 8.5.3 and 9.6.3.2 (SPDPdiscoveredParticipantData).
[[nodiscard]] std::optional<Announced> parse_announcement(const std::vector<std::uint8_t>& packet,
                                                          int domain, const std::string& from);

/// A peer that was asked for echoes.
struct PeerEcho {
  std::string host;
  std::size_t sent = 0, received = 0;
  double median_s = 0.0, worst_s = 0.0;  ///< Round trip; NaN without any.
  bool may_ask = true;                   ///< False: this user may not send ICMP.
};

/// How far the wall clock of a robot is ahead of this one, by the stamps of its messages: the least
/// of the differences, so that the time on the way adds at most its least. [s]
struct ClockDifference {
  std::string robot;
  double ahead_s = 0.0;
};

/// What can be found out about the network without taking part in a session.
struct NetworkFacts {
  DdsConfig config = {};
  std::vector<NetworkInterface> interfaces = {};
  std::optional<NetworkInterface> chosen = {};
  std::string no_interface = {};  ///< Why none was chosen.
  std::optional<int> mtu = {};
  std::optional<std::string> no_multicast =
      {};  ///< Why an own datagram to the group did not come back.
  std::optional<std::string> no_unicast = {};       ///< Likewise to the own address.
  std::optional<long> largest_receive_buffer = {};  ///< net.core.rmem_max [B].
  std::vector<Announced> announced = {};            ///< On any domain up to kLastQuietDomain.
  std::vector<Announced> heard = {};  ///< By DDS itself, as configured: also by address.
  double listened_s = 0.0;
  std::vector<PeerEcho> echoes = {};
  std::vector<ClockDifference> clocks = {};
};

/// Ids: network.interface, network.several_interfaces, network.loopback, network.no_multicast_flag,
/// network.multicast, network.firewall, network.mtu, network.buffers, network.domain_ports,
/// network.other_domain, network.other_team, network.protocol, network.same_id,
/// network.other_programs, network.nobody, network.unreachable, network.loss, network.slow,
/// network.clock.
[[nodiscard]] Examination examine_network(const NetworkFacts& facts);

}  // namespace km
