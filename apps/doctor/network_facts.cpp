#include "apps/doctor/network_facts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "modules/core/io/text_table.hpp"

namespace km {
namespace {

using enum Severity;

std::string name_of(const DiscoveredRobot& robot) {
  return robot.identity ? to_string(*robot.identity) : robot.address;
}

std::string joined(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void examine_interface(const NetworkFacts& facts, Examination& result) {
  if (!facts.chosen) {
    result.add(kError, "network.interface", facts.no_interface, "robots cannot reach each other",
               "name an interface that is up in --interface");
    return;
  }
  const NetworkInterface& chosen = *facts.chosen;
  result.figure("interface", chosen.name + ", " + chosen.address + ", MTU " +
                                 (chosen.mtu > 0 ? std::to_string(chosen.mtu) : "unknown") +
                                 ", datagrams of at most " +
                                 std::to_string(largest_datagram(facts.config, chosen)) + " B");
  const bool is_chosen = facts.config.interface.empty();  // by this program
  const OtherInterfaces others = others_than(chosen, facts.interfaces);
  if (is_chosen && !chosen.loopback && !others.reasons.empty())
    result.add(others.is_clear ? kNote : kWarning, "network.several_interfaces",
               chosen.name + " is used: " + others.reasons,
               "robots that are only on another interface are not received",
               "choose the interface with --interface");
  if (!chosen.carrier)
    result.add(kError, "network.no_carrier", chosen.name + " has no carrier",
               "nothing is connected to it: no cable, or no radio network",
               "connect it, or name another --interface");
  const auto outward = std::ranges::count(facts.interfaces, false, &NetworkInterface::loopback);
  if (chosen.loopback)
    result.add(kWarning, "network.loopback",
               outward == 0
                   ? std::string("only loopback is up")
                   : chosen.name + " is loopback" +
                         (!is_chosen || others.reasons.empty() ? "" : ": " + others.reasons),
               "robots on other hosts are out of reach",
               outward > 0 ? "name another --interface; robots on one host need none"
                           : "connect the host; robots on one host need no network");
  constexpr int kLeastMtu = 1280;
  if (chosen.mtu > 0 && chosen.mtu < kLeastMtu)
    result.add(kWarning, "network.mtu", "an MTU of " + std::to_string(chosen.mtu) + " B",
               "every message is split into many packets",
               "find out why the MTU is so low, for example because of a tunnel");
}

void examine_own_traffic(const NetworkFacts& facts, Examination& result) {
  if (!facts.chosen) return;
  const bool by_multicast = facts.config.discovery == Discovery::kMulticast;
  result.figure("multicast",
                facts.no_multicast ? *facts.no_multicast : "the test datagram was received");
  if (facts.no_multicast && by_multicast)
    result.add(kError, "network.multicast",
               "multicast to the group of DDS discovery: " + *facts.no_multicast,
               "robots do not find each other by multicast",
               "open UDP port " + std::to_string(7400 + 250 * facts.config.domain) +
                   " and group 239.255.0.1, or name the addresses of the robots in --peers");
  if (facts.no_unicast)
    result.add(
        kError, "network.firewall",
        "UDP to the own address " + facts.chosen->address + ": " + *facts.no_unicast,
        "a firewall on this host drops the messages of robots",
        "open UDP ports from " + std::to_string(7400 + 250 * facts.config.domain) + " upwards");
  if (facts.config.domain > static_cast<int>(kLastQuietDomain))
    result.add(kNote, "network.domain_ports",
               "the ports of domain " + std::to_string(facts.config.domain) +
                   " are among those that Linux gives to other programs",
               "a robot does not start if its port is taken",
               "use a domain up to " + std::to_string(kLastQuietDomain));
}

void examine_buffers(const NetworkFacts& facts, Examination& result) {
  if (!facts.largest_receive_buffer) return;
  const long granted = *facts.largest_receive_buffer, asked = facts.config.receive_buffer_bytes;
  result.figure("receive buffer", bytes_text(static_cast<double>(granted)) +
                                      " at most (net.core.rmem_max), asked for " +
                                      bytes_text(static_cast<double>(asked)));
  constexpr long kUsual = 212992;  // default of Linux
  if (granted >= asked) return;
  result.add(granted < kUsual ? kWarning : kNote, "network.buffers",
             "the kernel grants receive buffers of " + bytes_text(static_cast<double>(granted)) +
                 ", dds.receive_buffer_bytes asks for " + bytes_text(static_cast<double>(asked)),
             "bursts of keyframes, meshes and images are lost and have to be sent again",
             "sysctl -w net.core.rmem_max=" + std::to_string(asked));
}

void examine_ids(const std::vector<DiscoveredRobot>& robots, Examination& result) {
  // Robots with keys and those without ignore each other.
  std::map<std::pair<RobotId, bool>, std::map<std::uint64_t, std::string>> processes;
  for (const DiscoveredRobot& robot : robots)
    if (robot.identity)
      processes[{robot.identity->robot, robot.has_keys}][robot.identity->boot] =
          name_of(robot) + " at " + robot.address;
  for (const auto& [key, boots] : processes) {
    if (boots.size() < 2) continue;
    std::set<std::string> names;
    for (const auto& [boot, name] : boots) names.insert(name);
    result.add(kError, "network.same_id",
               std::to_string(boots.size()) + " robots have id " + std::to_string(key.first) +
                   ": " + joined(names),
               "the robot that started last stops", "give every robot its own --robot");
  }
}

void examine_elsewhere(const NetworkFacts& facts, bool is_alone, Examination& result) {
  const std::string domain = std::to_string(facts.config.domain);
  for (const auto& [where, addresses] : facts.elsewhere)
    if (where.domain == facts.config.domain)
      result.add(kWarning, "network.other_interface",
                 "programs at " + joined(addresses) + " use DDS domain " + domain + " on " +
                     where.interface + ", but " + facts.chosen->name + " is used",
                 "robots that are only on " + where.interface + " are not received",
                 "choose the interface with --interface");
    else if (is_alone)
      result.add(
          kWarning, "network.other_domain",
          "programs at " + joined(addresses) + " use DDS domain " + std::to_string(where.domain) +
              ", not " + domain,
          "robots of different domains do not receive each other; ROS 2 uses domain 0 by default",
          "give all robots of the team the same --domain");
  if (facts.ros_topics > 0)
    result.add(kNote, "network.other_programs",
               "ROS 2 programs publish " + std::to_string(facts.ros_topics) + " topics on domain " +
                   domain,
               "they share the ports and the traffic of the team",
               "give the team a domain of its own");
}

void examine_silence(const DiscoveredRobot& robot, Examination& result) {
  constexpr double kAnswers_s = 1.5;  // two robots that hear each other need less than a second
  if (robot.unanswered_s > kAnswers_s)
    result.add(kError, "network.one_sided",
               name_of(robot) + " at " + robot.address +
                   " is heard but does not hear this host: no answer in " +
                   fixed(robot.unanswered_s, 1) + " s",
               "a firewall or NAT drops what is sent there: the robots do not meet",
               "open its UDP ports from 7400 + 250 * domain upwards; across NAT use a VPN");
}

void examine_keys(const std::vector<DiscoveredRobot>& robots, Examination& result) {
  std::array<std::set<std::string>, 2> names;  // without keys, with keys
  for (const DiscoveredRobot& robot : robots) names[robot.has_keys ? 1 : 0].insert(name_of(robot));
  if (!names[0].empty() && !names[1].empty())
    result.add(kError, "network.keys",
               joined(names[1]) + " have keys of a team, " + joined(names[0]) + " have none",
               "the two groups ignore each other",
               "give each robot its folder of kimera_multi_keys (--security), or none any");
}

void examine_robots(const NetworkFacts& facts, Examination& result) {
  std::set<std::string> names;
  for (const DiscoveredRobot& robot : facts.robots) {
    if (robot.identity && robot.identity->protocol == kProtocolVersion) {
      names.insert(name_of(robot));
      examine_silence(robot, result);
      continue;
    }
    result.add(kError, "network.protocol",
               name_of(robot) + " at " + robot.address + " uses protocol " +
                   (robot.identity ? std::to_string(robot.identity->protocol) : "unknown") +
                   ", this program uses " + std::to_string(kProtocolVersion),
               "the robots of the team ignore it",
               "install the same version of the programs on all robots");
  }
  result.figure("robots received", (names.empty() ? "none" : joined(names)) + " of team " +
                                       facts.config.team + " on domain " +
                                       std::to_string(facts.config.domain) + ", in " +
                                       fixed(facts.listened_s, 1) + " s");
  examine_ids(facts.robots, result);
  examine_keys(facts.robots, result);
  // If peers on other hosts are named, robots on this host do not count.
  const std::string here = '/' + facts.chosen->address + ':';
  const bool asks_others = std::ranges::any_of(
      facts.config.peers, [&](const std::string& peer) { return '/' + peer + ':' != here; });
  const bool is_alone = std::ranges::all_of(facts.robots, [&](const DiscoveredRobot& robot) {
    return asks_others && robot.address.find(here) != robot.address.npos;
  });
  examine_elsewhere(facts, is_alone, result);
  if (is_alone)
    result.add(facts.config.peers.empty() ? kNote : kWarning, "network.no_peers",
               "no robot of team " + facts.config.team + (asks_others ? " on another host" : "") +
                   " is received in " + fixed(facts.listened_s, 1) + " s",
               "none runs, it has another dds.team, or one of the other findings is the reason",
               "start a robot on another host, or name the address of a running one in --peers");
}

void examine_echo(const PeerEcho& peer, Examination& result) {
  if (!peer.may_send_icmp) {
    result.figure("peer " + peer.host,
                  "not determined: this user may not send ICMP (net.ipv4.ping_group_range)");
    return;
  }
  const double loss = 1.0 - static_cast<double>(peer.received) /
                                static_cast<double>(std::max<std::size_t>(peer.sent, 1));
  result.figure("peer " + peer.host, "round trip " + fixed(1e3 * peer.median_s, 1) +
                                         " ms, at most " + fixed(1e3 * peer.worst_s, 1) + " ms, " +
                                         std::to_string(peer.sent - peer.received) + " of " +
                                         std::to_string(peer.sent) + " lost");
  constexpr double kMuchLoss = 0.05, kSlow_s = 0.2;
  if (peer.received == 0)
    result.add(kWarning, "network.unreachable",
               peer.host + " answers none of " + std::to_string(peer.sent) + " echo requests",
               "the host is out of reach, or drops echo requests",
               "check its address, cable and radio");
  else if (loss > kMuchLoss)
    result.add(kWarning, "network.loss",
               fixed(100.0 * loss, 0) + " % of the echoes of " + peer.host + " are lost",
               "lost messages have to be sent again",
               "use --link wifi or intermittent, and a budget");
  if (auto path = path_finding(peer)) result.findings.push_back(*std::move(path));
  if (peer.received > 0 && peer.median_s > kSlow_s)
    result.add(kWarning, "network.slow",
               "a round trip of " + fixed(1e3 * peer.median_s, 0) + " ms to " + peer.host,
               "loop closures come late, and requests may be repeated", "use --link intermittent");
}

void examine_clock(const ClockDifference& clock, Examination& result) {
  result.figure("clock of " + clock.robot,
                fixed(clock.ahead_s, 3) + " s ahead, including the time of transmission");
  constexpr double kMuch_s = 1.0;
  if (std::abs(clock.ahead_s) > kMuch_s)
    result.add(kNote, "network.clock",
               "the clock of " + clock.robot + " is " + fixed(std::abs(clock.ahead_s), 1) + " s " +
                   (clock.ahead_s > 0.0 ? "ahead of" : "behind") + " this one",
               "the team does not need equal clocks, but the times in logs of robots differ",
               "set the clocks with NTP or chrony");
}

}  // namespace

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
