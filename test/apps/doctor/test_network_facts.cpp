#include <catch2/catch.hpp>

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "apps/doctor/network_facts.hpp"
#include "modules/diagnosis/finding.hpp"
#include "test/support/process.hpp"

namespace km {
namespace {

const NetworkInterface kEthernet{
    .name = "eth0", .address = "10.0.0.1", .multicast = true, .loopback = false};

DiscoveredRobot robot(RobotId id, const std::string& name) {
  return {.address = "udp/10.0.0.2:7411",
          .identity = RobotIdentity{.robot = id, .name = name, .boot = 0x10000U + id}};
}

// A sound host, with another robot of the team in reach.
NetworkFacts sound() {
  NetworkFacts facts;
  facts.config.domain = 42;
  facts.interfaces = {kEthernet};
  facts.chosen = kEthernet;
  facts.mtu = 1500;
  facts.largest_receive_buffer = facts.config.receive_buffer_bytes;
  facts.robots = {robot(3, "carol")};
  facts.listened_s = 5.0;
  return facts;
}

std::string ids_of(const NetworkFacts& facts) {
  std::string ids;
  for (const Finding& finding : examine_network(facts).findings)
    ids += std::string(to_string(finding.severity)) + ' ' + finding.id + ' ';
  return ids;
}

}  // namespace

TEST_CASE("A sound network has no findings", "[doctor]") {
  NetworkFacts facts = sound();
  CHECK(ids_of(facts).empty());
  facts.other_domains = {{0, {"10.0.0.9"}}};  // ROS 2, or another team
  facts.echoes = {
      {.host = "10.0.0.2", .sent = 20, .received = 20, .median_s = 2e-3, .worst_s = 9e-3}};
  facts.clocks = {{"alice (id 7)", -0.002}};
  CHECK(ids_of(facts).empty());
}

TEST_CASE("The reason that keeps robots apart on a network is named", "[doctor]") {
  struct Case {
    std::string ids;
    std::function<void(NetworkFacts&)> change;
  };
  const auto echo = [](PeerEcho peer) {
    peer.host = "10.0.0.2";
    return [peer](NetworkFacts& facts) {
      facts.config.peers = {peer.host};
      facts.echoes = {peer};
    };
  };
  const Case c = GENERATE_COPY(
      Case{"error network.interface ", [](auto& facts) { facts.chosen.reset(); }},
      Case{"note network.several_interfaces ",
           [](auto& facts) {
             facts.interfaces.push_back({"wlan0", "10.1.0.1", true, false});
           }},
      Case{"",
           [](auto& facts) {
             facts.interfaces.push_back({"wlan0", "10.1.0.1", true, false});
             facts.config.interface = "eth0";
           }},
      Case{"error network.multicast ", [](auto& facts) { facts.no_multicast = "lost"; }},
      Case{"",
           [](auto& facts) {
             facts.no_multicast = "lost";
             facts.config.discovery = Discovery::kPeers;  // it is not needed
           }},
      Case{"error network.firewall ", [](auto& facts) { facts.no_unicast = "lost"; }},
      Case{"warning network.buffers ", [](auto& facts) { facts.largest_receive_buffer = 65536; }},
      Case{"note network.buffers ",  // Linux' usual: it works
           [](auto& facts) { facts.largest_receive_buffer = 212992; }},
      Case{"warning network.mtu ", [](auto& facts) { facts.mtu = 576; }},
      Case{"warning network.mtu ", [](auto& facts) { facts.chosen->name = "wlan0"; }},
      Case{"",
           [](auto& facts) {
             facts.chosen->name = "wlan0";
             facts.config.max_message_bytes = 1400;
           }},
      Case{"error network.protocol ",
           [](auto& facts) { facts.robots[0].identity->protocol = kProtocolVersion + 1; }},
      Case{"error network.protocol ", [](auto& facts) { facts.robots[0].identity.reset(); }},
      Case{"",  // one process, received twice
           [](auto& facts) {
             facts.robots = {robot(7, "alice"), robot(7, "alice")};
           }},
      Case{"error network.same_id ",
           [](auto& facts) {
             facts.robots = {robot(7, "alice"), robot(7, "bob")};
             facts.robots[1].identity->boot = 0x50000;
           }},
      Case{"note network.other_programs ", [](auto& facts) { facts.ros_topics = 3; }},
      Case{"warning network.unreachable ", echo({.host = {}, .sent = 20})},
      Case{"warning network.loss ", echo({.host = {}, .sent = 20, .received = 15})},
      Case{"warning network.slow ",
           echo({.host = {}, .sent = 20, .received = 20, .median_s = 0.4})},
      Case{"", echo({.host = {}, .may_send_icmp = false})},
      Case{"warning network.no_peers ",
           [](auto& facts) {
             facts.config.peers = {"10.0.0.2"};
             facts.robots.clear();
           }},
      Case{"note network.no_peers ", [](auto& facts) { facts.robots.clear(); }},
      Case{"warning network.other_domain note network.no_peers ",
           [](auto& facts) {
             facts.robots.clear();
             facts.other_domains = {{43, {"10.0.0.2", "10.0.0.3"}}};
           }},
      Case{"note network.clock ", [](auto& facts) {
             facts.clocks = {{"alice", 3600.0}};
           }});
  CAPTURE(c.ids);
  NetworkFacts facts = sound();
  c.change(facts);
  CHECK(ids_of(facts) == c.ids);
}

TEST_CASE("On loopback alone the finding depends on whether the host has another interface",
          "[doctor]") {
  NetworkFacts facts = sound();
  facts.chosen = NetworkInterface{"lo", "127.0.0.1", true, true};
  CHECK_THAT(examine_network(facts).findings.at(0).what, Catch::Equals("lo is loopback"));
  facts.interfaces = {*facts.chosen};
  CHECK_THAT(examine_network(facts).findings.at(0).what, Catch::Equals("only loopback is up"));
}

TEST_CASE("The doctor finds a robot on its domain, and its address on another one", "[doctor]") {
  std::random_device device;
  DdsConfig config;
  config.domain = static_cast<int>(device() % 90);
  config.team = "test-" + std::to_string(device());
  config.interface = "lo";
  const Process peer({KM_BIN_DIR "/test_dds_peer", "7", "", "dds.team=" + config.team,
                      "dds.domain=" + std::to_string(config.domain), "dds.interface=lo",
                      "dds.spdp_interval_s=0.2"});
  const std::string found = GENERATE("(id 7)", "warning network.other_domain");
  if (found != "(id 7)") ++config.domain;
  const auto text = [&] {
    const NetworkFacts facts = probe_network(config, 0.5, [](std::string_view, double) {});
    return ids_of(facts) + to_text(examine_network(facts).figures);
  };
  std::string last;
  for (int tries = 0; tries < 20 && last.find(found) == last.npos; ++tries) last = text();
  CHECK_THAT(last, Catch::Contains(found));
}

}  // namespace km
