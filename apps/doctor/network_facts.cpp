#include "apps/doctor/network_facts.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <span>

#include "modules/core/text_rows.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

// RTPS 2.5: Sec. 8.3.3 (header), 9.4.5.4 (DATA), 9.6.4 (parameters).
constexpr std::size_t kPrefixAt = 8, kHeaderBytes = 20, kSubmessageHeaderBytes = 4,
                      kDataFieldsBytes = 20;
constexpr std::uint8_t kData = 0x15;
constexpr std::uint8_t kLittleEndian = 1, kInlineQos = 2, kHasPayload = 4;
constexpr std::uint32_t kParticipantWriter = 0x100c2;  // entity id of the SPDP writer
constexpr std::uint16_t kSentinel = 1, kDomainId = 0x0f, kUserData = 0x2c, kDomainTag = 0x4014;

// Reads numbers of either byte order, and never beyond the end.
class Bytes {
 public:
  Bytes(std::span<const std::uint8_t> bytes, bool is_little)
      : bytes_(bytes), is_little_(is_little) {}

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::uint32_t number(std::size_t at, std::size_t count) const {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < count && at + count <= size(); ++k)
      value = (value << 8U) | bytes_[is_little_ ? at + count - 1 - k : at + k];
    return value;
  }
  [[nodiscard]] std::span<const std::uint8_t> part(std::size_t at, std::size_t count) const {
    if (at > size()) return {};
    return bytes_.subspan(at, std::min(count, size() - at));
  }
  // A sequence of octets or characters, preceded by its length.
  [[nodiscard]] std::string text(std::size_t at) const {
    const auto found = part(at + 4, number(at, 4));
    std::string result(found.begin(), found.end());
    if (result.ends_with('\0')) result.pop_back();
    return result;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool is_little_;
};

// Calls use(id, offset of the value) for each parameter; returns the offset behind the parameters.
std::size_t for_each_parameter(const Bytes& bytes, std::size_t at, const auto& use) {
  while (at + 4 <= bytes.size()) {
    const auto id = static_cast<std::uint16_t>(bytes.number(at, 2));
    const std::size_t length = bytes.number(at + 2, 2);
    at += 4;
    if (id == kSentinel) break;
    use(id, at);
    at += length;
  }
  return at;
}

void read_participant(std::span<const std::uint8_t> payload, AnnouncedParticipant& found) {
  constexpr std::size_t kEncapsulation = 4;
  if (payload.size() < kEncapsulation) return;
  const Bytes bytes(payload, payload[1] == 3);  // PL_CDR_LE
  for_each_parameter(bytes, kEncapsulation, [&](std::uint16_t id, std::size_t at) {
    if (id == kDomainId) found.domain = static_cast<int>(bytes.number(at, 4));
    if (id == kDomainTag) found.team = readable(bytes.text(at), 100);
    if (id == kUserData) found.user_data = bytes.text(at);
  });
  if (claims_to_be_a_robot(found.user_data))
    if (const auto announcement = parse_user_data(found.user_data).value)
      found.identity = announcement->identity;
}

Finding warning(const char* id, std::string what, const char* means, const char* to_do) {
  return {.id = id,
          .severity = Severity::kWarning,
          .what = std::move(what),
          .means = means,
          .to_do = to_do};
}

std::string name_of(const AnnouncedParticipant& robot) {
  return robot.identity ? to_string(*robot.identity) : robot.from;
}

std::string names_of(const std::vector<AnnouncedParticipant>& robots) {
  std::set<std::string> names;
  for (const AnnouncedParticipant& robot : robots) names.insert(name_of(robot));
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void examine_interface(const NetworkFacts& facts, Examination& result) {
  if (!facts.chosen) {
    result.findings.push_back({.id = "network.interface",
                               .severity = Severity::kError,
                               .what = facts.no_interface,
                               .means = "robots have no way to each other",
                               .to_do = "--interface with one that is up"});
    return;
  }
  const NetworkInterface& chosen = *facts.chosen;
  result.figures.push_back({"interface", chosen.name + ", " + chosen.address + ", MTU " +
                                             (facts.mtu ? std::to_string(*facts.mtu) : "unknown")});
  const auto outward = std::ranges::count(facts.interfaces, false, &NetworkInterface::loopback);
  if (facts.config.interface.empty() && outward > 1)
    result.findings.push_back(
        {.id = "network.several_interfaces",
         .severity = Severity::kNote,
         .what = std::to_string(outward) + " interfaces are up, " + chosen.name + " is used",
         .means = "robots on another one are not received",
         .to_do = "--interface chooses"});
  if (chosen.loopback)
    result.findings.push_back(
        warning("network.loopback",
                outward > 0 ? chosen.name + " is loopback" : std::string("only loopback is up"),
                "robots on other hosts are out of reach",
                outward > 0 ? "another --interface; on one host it will do"
                            : "connect the host; on one host it will do"));
  constexpr int kLeastMtu = 1280;
  const bool is_wireless = chosen.name.starts_with("wl");
  if (facts.mtu && *facts.mtu < kLeastMtu)
    result.findings.push_back(
        warning("network.mtu", "an MTU of " + std::to_string(*facts.mtu) + " B",
                "every message goes in many packets", "see why it is so low (a tunnel?)"));
  if (facts.mtu && is_wireless && facts.config.max_message_bytes > *facts.mtu)
    result.findings.push_back(
        warning("network.mtu",
                "messages of up to " + std::to_string(facts.config.max_message_bytes) +
                    " B on a radio link with an MTU of " + std::to_string(*facts.mtu) + " B",
                "one lost packet of up to 45 loses the message", "--link wifi"));
}

void examine_own_traffic(const NetworkFacts& facts, Examination& result) {
  if (!facts.chosen) return;
  const bool by_multicast = facts.config.discovery == Discovery::kMulticast;
  result.figures.push_back(
      {"multicast", facts.no_multicast ? *facts.no_multicast : "an own datagram came back"});
  if (facts.no_multicast && by_multicast)
    result.findings.push_back(
        {.id = "network.multicast",
         .severity = Severity::kError,
         .what = "multicast to the group of DDS discovery: " + *facts.no_multicast,
         .means = "robots do not find each other by multicast",
         .to_do = "open UDP port " + std::to_string(7400 + 250 * facts.config.domain) +
                  " and group 239.255.0.1, or --peers with addresses"});
  if (facts.no_unicast)
    result.findings.push_back(
        {.id = "network.firewall",
         .severity = Severity::kError,
         .what = "UDP to the own address " + facts.chosen->address + ": " + *facts.no_unicast,
         .means = "a firewall on this host drops what robots send",
         .to_do = "open UDP ports from " + std::to_string(7400 + 250 * facts.config.domain) +
                  " upwards"});
  if (facts.config.domain > static_cast<int>(kLastQuietDomain))
    result.findings.push_back({.id = "network.domain_ports",
                               .severity = Severity::kNote,
                               .what = "the ports of domain " +
                                       std::to_string(facts.config.domain) +
                                       " are among those that other programs are given",
                               .means = "a robot may find one taken and not start",
                               .to_do = "a domain up to " + std::to_string(kLastQuietDomain)});
}

void examine_buffers(const NetworkFacts& facts, Examination& result) {
  if (!facts.largest_receive_buffer) return;
  const long granted = *facts.largest_receive_buffer, asked = facts.config.receive_buffer_bytes;
  result.figures.push_back({"receive buffer", bytes_text(static_cast<double>(granted)) +
                                                  " at most (net.core.rmem_max), asked for " +
                                                  bytes_text(static_cast<double>(asked))});
  constexpr long kUsual = 212992;  // default of Linux
  if (granted >= asked) return;
  result.findings.push_back(
      {.id = "network.buffers",
       .severity = granted < kUsual ? Severity::kWarning : Severity::kNote,
       .what = "the kernel grants receive buffers of " + bytes_text(static_cast<double>(granted)) +
               ", dds.receive_buffer_bytes asks for " + bytes_text(static_cast<double>(asked)),
       .means = "bursts are lost and sent again: keyframes, meshes, images of drivers",
       .to_do = "sysctl -w net.core.rmem_max=" + std::to_string(asked)});
}

// Robots of this team, and other robots by the reason why they are not in this team.
struct Robots {
  std::vector<AnnouncedParticipant> of_team, of_other_team, on_other_domain, other_protocol;
  std::size_t other_programs = 0;

  [[nodiscard]] bool are_none() const {
    return of_team.empty() && of_other_team.empty() && on_other_domain.empty() &&
           other_protocol.empty();
  }
};

Robots sorted(const NetworkFacts& facts) {
  Robots robots;
  std::vector<AnnouncedParticipant> all = facts.announced;
  all.insert(all.end(), facts.received.begin(), facts.received.end());
  for (const AnnouncedParticipant& one : all) {
    const bool is_robot = claims_to_be_a_robot(one.user_data);
    if (!is_robot) {
      robots.other_programs += one.domain == facts.config.domain ? 1 : 0;
    } else if (one.domain != facts.config.domain) {
      robots.on_other_domain.push_back(one);
    } else if (one.team != facts.config.team) {
      robots.of_other_team.push_back(one);
    } else if (!one.identity || one.identity->protocol != kProtocolVersion) {
      robots.other_protocol.push_back(one);
    } else {
      robots.of_team.push_back(one);
    }
  }
  return robots;
}

void examine_ids(const std::vector<AnnouncedParticipant>& team, Examination& result) {
  std::map<RobotId, std::map<std::uint64_t, std::string>> processes;
  for (const AnnouncedParticipant& robot : team)
    processes[robot.identity->robot][robot.identity->boot] = name_of(robot) + " at " + robot.from;
  for (const auto& [id, boots] : processes) {
    if (boots.size() < 2) continue;
    std::string names;
    for (const auto& [boot, name] : boots) names += (names.empty() ? "" : ", ") + name;
    result.findings.push_back({.id = "network.same_id",
                               .severity = Severity::kError,
                               .what = std::to_string(boots.size()) + " robots have id " +
                                       std::to_string(id) + ": " + names,
                               .means = "the younger one ends",
                               .to_do = "give every robot its own --robot"});
  }
}

void examine_robots(const NetworkFacts& facts, Examination& result) {
  const Robots robots = sorted(facts);
  const std::string domain = std::to_string(facts.config.domain);
  result.figures.push_back(
      {"robots received", (robots.of_team.empty() ? "none" : names_of(robots.of_team)) +
                              " of team " + facts.config.team + " on domain " + domain + ", in " +
                              fixed(facts.listened_s, 1) + " s"});
  if (!robots.on_other_domain.empty())
    result.findings.push_back(warning(
        "network.other_domain",
        names_of(robots.on_other_domain) + " on domain " +
            std::to_string(robots.on_other_domain.front().domain) + ", not " + domain,
        "robots of different domains do not receive each other", "the same --domain for all"));
  if (!robots.of_other_team.empty())
    result.findings.push_back(
        {.id = "network.other_team",
         .severity = robots.of_team.empty() ? Severity::kWarning : Severity::kNote,
         .what = names_of(robots.of_other_team) + " of team " + robots.of_other_team.front().team +
                 ", not " + facts.config.team,
         .means = "robots of different teams do not see each other",
         .to_do = "the same dds.team, if they are to be one"});
  for (const AnnouncedParticipant& robot : robots.other_protocol)
    result.findings.push_back(
        {.id = "network.protocol",
         .severity = Severity::kError,
         .what = name_of(robot) + " at " + robot.from + " uses protocol " +
                 (robot.identity ? std::to_string(robot.identity->protocol) : "unknown") +
                 ", this is " + std::to_string(kProtocolVersion),
         .means = "it is not talked to",
         .to_do = "the same version of the programs on all robots"});
  if (robots.other_programs > 0)
    result.findings.push_back({.id = "network.other_programs",
                               .severity = Severity::kNote,
                               .what = std::to_string(robots.other_programs) +
                                       " other DDS programs are on domain " + domain,
                               .means = "they share its ports (ROS 2?) but not its messages",
                               .to_do = "a domain of its own is quieter"});
  examine_ids(robots.of_team, result);
  if (!facts.config.peers.empty() && robots.of_team.empty())
    result.findings.push_back(warning("network.no_peers", "no robot of the team is received",
                                      "none runs, or it is kept out by what stands here",
                                      "start it, and see its log for the interface it uses"));
  else if (robots.are_none())
    result.findings.push_back(
        {.id = "network.no_peers",
         .severity = Severity::kNote,
         .what = "no robot announced itself on any domain in " + fixed(facts.listened_s, 1) + " s",
         .means = "this host is ready; whether others reach it is not known",
         .to_do =
             "start a robot on another host and look again; of one that runs, --peers ADDRESS"});
}

void examine_echo(const PeerEcho& peer, Examination& result) {
  if (!peer.may_send_icmp) {
    result.figures.push_back(
        {"peer " + peer.host,
         "not determined: this user may not send ICMP (net.ipv4.ping_group_range)"});
    return;
  }
  const double loss = 1.0 - static_cast<double>(peer.received) /
                                static_cast<double>(std::max<std::size_t>(peer.sent, 1));
  result.figures.push_back({"peer " + peer.host, "round trip " + fixed(1e3 * peer.median_s, 1) +
                                                     " ms, at most " +
                                                     fixed(1e3 * peer.worst_s, 1) + " ms, " +
                                                     std::to_string(peer.sent - peer.received) +
                                                     " of " + std::to_string(peer.sent) + " lost"});
  constexpr double kMuchLoss = 0.05, kSlow_s = 0.2;
  if (peer.received == 0)
    result.findings.push_back(
        warning("network.unreachable",
                peer.host + " answers none of " + std::to_string(peer.sent) + " echo requests",
                "it is out of reach, or drops them", "see its address, cable, and radio"));
  else if (loss > kMuchLoss)
    result.findings.push_back(warning(
        "network.loss", fixed(100.0 * loss, 0) + " % of the echoes of " + peer.host + " are lost",
        "messages are sent again and again", "--link wifi or intermittent, and a budget"));
  if (peer.received > 0 && peer.median_s > kSlow_s)
    result.findings.push_back(warning(
        "network.slow", "a round trip of " + fixed(1e3 * peer.median_s, 0) + " ms to " + peer.host,
        "closures come late; requests may be asked again", "--link intermittent"));
}

void examine_clock(const ClockDifference& clock, Examination& result) {
  result.figures.push_back({"clock of " + clock.robot,
                            fixed(clock.ahead_s, 3) + " s ahead, of which the way takes a part"});
  constexpr double kMuch_s = 1.0;
  if (std::abs(clock.ahead_s) > kMuch_s)
    result.findings.push_back(
        {.id = "network.clock",
         .severity = Severity::kNote,
         .what = "the clock of " + clock.robot + " is " + fixed(std::abs(clock.ahead_s), 1) +
                 " s " + (clock.ahead_s > 0.0 ? "ahead of" : "behind") + " this one",
         .means = "the team does not need one clock; logs of robots do not go together",
         .to_do = "NTP or chrony"});
}

}  // namespace

std::optional<AnnouncedParticipant> parse_announcement(const std::vector<std::uint8_t>& packet,
                                                       int domain, const std::string& from) {
  if (packet.size() < kHeaderBytes || std::memcmp(packet.data(), "RTPS", 4) != 0)
    return std::nullopt;
  std::size_t at = kHeaderBytes;
  while (at + kSubmessageHeaderBytes <= packet.size()) {
    const std::uint8_t kind = packet[at], flags = packet[at + 1];
    const Bytes bytes(packet, (flags & kLittleEndian) != 0);
    const std::size_t length = bytes.number(at + 2, 2), begin = at + kSubmessageHeaderBytes;
    const std::size_t end = length == 0 ? packet.size() : std::min(packet.size(), begin + length);
    at = end;
    if (kind != kData || (flags & kHasPayload) == 0 || begin + kDataFieldsBytes > end) continue;
    // Entity ids are bytes in network order in both byte orders.
    if (Bytes(packet, false).number(begin + 8, 4) != kParticipantWriter) continue;
    const Bytes submessage({packet.data(), end}, (flags & kLittleEndian) != 0);
    std::size_t payload = begin + 4 + submessage.number(begin + 2, 2);
    if ((flags & kInlineQos) != 0)
      payload = for_each_parameter(submessage, payload, [](std::uint16_t, std::size_t) {});
    AnnouncedParticipant found{.guid_prefix = {},
                               .domain = domain,
                               .team = {},
                               .from = from,
                               .user_data = {},
                               .identity = {}};
    std::copy_n(packet.begin() + kPrefixAt, found.guid_prefix.size(), found.guid_prefix.begin());
    read_participant(submessage.part(payload, end), found);
    return found;
  }
  return std::nullopt;
}

Examination examine_network(const NetworkFacts& facts) {
  Examination result;
  examine_interface(facts, result);
  examine_own_traffic(facts, result);
  examine_buffers(facts, result);
  if (facts.chosen) examine_robots(facts, result);
  for (const PeerEcho& peer : facts.echoes) examine_echo(peer, result);
  for (const ClockDifference& clock : facts.clocks) examine_clock(clock, result);
  sort_by_severity(result.findings);
  return result;
}

}  // namespace km
