#include <catch2/catch.hpp>

#include <random>
#include <string>
#include <vector>

#include "apps/doctor/network_facts.hpp"
#include "apps/doctor/network_probe.hpp"
#include "runtime/dds/participant.hpp"

namespace km {
namespace {

const NetworkInterface kEthernet{
    .name = "eth0", .address = "10.0.0.1", .multicast = true, .loopback = false};

AnnouncedParticipant robot(RobotId id, const std::string& name, int domain = 42,
                           const std::string& team = "kimera-multi") {
  const RobotIdentity identity{.robot = id, .name = name, .boot = 0x10000U + id};
  return {.domain = domain,
          .team = team,
          .from = "10.0.0.2",
          .user_data = to_user_data(identity),
          .identity = identity};
}

// A sound host, with another robot of the team in reach.
NetworkFacts sound() {
  NetworkFacts facts;
  facts.config.domain = 42;
  facts.interfaces = {kEthernet};
  facts.chosen = kEthernet;
  facts.mtu = 1500;
  facts.largest_receive_buffer = facts.config.receive_buffer_bytes;
  facts.announced = {robot(3, "carol")};
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
  facts.announced = {robot(7, "alice")};
  facts.received = facts.announced;  // the same process, received twice
  facts.echoes = {
      {.host = "10.0.0.2", .sent = 20, .received = 20, .median_s = 2e-3, .worst_s = 9e-3}};
  facts.clocks = {{"alice (id 7)", -0.002}};
  CHECK(ids_of(facts).empty());
}

TEST_CASE("The reason that keeps robots apart on a network is named", "[doctor]") {
  NetworkFacts facts = sound();
  SECTION("no interface") {
    facts.chosen.reset();
    facts.no_interface = "none is up";
    CHECK(ids_of(facts) == "error network.interface ");
  }
  SECTION("several interfaces") {
    facts.interfaces.push_back({"wlan0", "10.1.0.1", true, false});
    CHECK(ids_of(facts) == "note network.several_interfaces ");
    facts.config.interface = "eth0";
    CHECK(ids_of(facts).empty());
  }
  SECTION("loopback, chosen or the only one") {
    facts.chosen = NetworkInterface{"lo", "127.0.0.1", true, true};
    CHECK_THAT(examine_network(facts).findings.at(0).what, Catch::Equals("lo is loopback"));
    facts.interfaces = {*facts.chosen};
    CHECK_THAT(examine_network(facts).findings.at(0).what, Catch::Equals("only loopback is up"));
  }
  SECTION("multicast") {
    facts.no_multicast = "an own datagram did not come back";
    CHECK(ids_of(facts) == "error network.multicast ");
    facts.config.discovery = Discovery::kPeers;  // it is not needed
    CHECK(ids_of(facts).empty());
  }
  SECTION("a firewall") {
    facts.no_unicast = "an own datagram did not come back";
    CHECK(ids_of(facts) == "error network.firewall ");
  }
  SECTION("tiny buffers") {
    facts.largest_receive_buffer = 65536;
    CHECK(ids_of(facts) == "warning network.buffers ");
    facts.largest_receive_buffer = 212992;  // Linux' usual: it works
    CHECK(ids_of(facts) == "note network.buffers ");
  }
  SECTION("a tiny MTU") {
    facts.mtu = 576;
    CHECK(ids_of(facts) == "warning network.mtu ");
  }
  SECTION("a profile for cables on a radio") {
    facts.chosen->name = "wlan0";
    CHECK(ids_of(facts) == "warning network.mtu ");
    facts.config.max_message_bytes = 1400;
    CHECK(ids_of(facts).empty());
  }
  SECTION("another domain") {
    facts.announced = {robot(7, "alice", 43)};
    CHECK(ids_of(facts) == "warning network.other_domain ");
    CHECK(examine_network(facts).findings[0].what == "alice (id 7) on domain 43, not 42");
  }
  SECTION("another team") {
    facts.announced = {robot(7, "alice", 42, "others")};
    CHECK(ids_of(facts) == "warning network.other_team ");
    facts.announced.push_back(robot(8, "bob"));
    CHECK(ids_of(facts) == "note network.other_team ");
  }
  SECTION("another version") {
    facts.announced = {robot(7, "alice")};
    facts.announced[0].identity->protocol = kProtocolVersion + 1;
    CHECK(ids_of(facts) == "error network.protocol ");
  }
  SECTION("one id twice") {
    facts.announced = {robot(7, "alice"), robot(7, "bob")};
    facts.announced[1].identity->boot = 0x50000;
    CHECK(ids_of(facts) == "error network.same_id ");
  }
  SECTION("other programs") {
    facts.announced.push_back({.domain = 42, .from = "10.0.0.9"});
    facts.announced.push_back({.domain = 0, .from = "10.0.0.9"});
    CHECK(ids_of(facts) == "note network.other_programs ");
    CHECK_THAT(examine_network(facts).findings[0].what, Catch::StartsWith("1 other DDS"));
  }
  SECTION("peers") {
    facts.config.peers = {"10.0.0.2"};
    facts.received = {robot(7, "alice")};
    facts.echoes = {{.host = "10.0.0.2", .sent = 20}};
    CHECK(ids_of(facts) == "warning network.unreachable ");
    facts.echoes[0].received = 15;
    CHECK(ids_of(facts) == "warning network.loss ");
    facts.echoes[0] = {.host = "10.0.0.2", .sent = 20, .received = 20, .median_s = 0.4};
    CHECK(ids_of(facts) == "warning network.slow ");
    facts.echoes[0] = {.host = "10.0.0.2", .may_send_icmp = false};
    facts.received.clear();
    facts.announced.clear();
    CHECK(ids_of(facts) == "warning network.no_peers ");
  }
  SECTION("no other robot") {
    facts.announced.clear();
    CHECK(ids_of(facts) == "note network.no_peers ");
    CHECK(examine_network(facts).findings[0].what ==
          "no robot announced itself on any domain in 5.0 s");
    facts.announced = {robot(7, "alice", 43)};  // the other domain is the reason
    CHECK(ids_of(facts) == "warning network.other_domain ");
  }
  SECTION("a clock") {
    facts.clocks = {{"alice", 3600.0}};
    CHECK(ids_of(facts) == "note network.clock ");
  }
}

TEST_CASE("A robot is received on its domain and in its team, whichever is looked for",
          "[doctor]") {
  std::random_device device;
  const int domain = static_cast<int>(device() % 90);
  const std::string team = "test-" + std::to_string(device());
  DdsConfig config;
  config.domain = domain;
  config.team = team;
  config.interface = "lo";
  config.spdp_interval_s = 0.2;
  const DdsParticipant alice(config, {.robot = 7, .name = "alice", .boot = random_boot_id()});
  config.domain = domain + 1;
  std::string ids;
  for (int tries = 0; tries < 20 && ids.find("network.other_domain") == ids.npos; ++tries)
    ids = ids_of(probe_network(config, 0.5, [](std::string_view, double) {}));
  CHECK_THAT(ids, Catch::Contains("warning network.other_domain"));
}

TEST_CASE("Packets without an announcement are skipped", "[doctor]") {
  CHECK_FALSE(parse_announcement({}, 0, ""));
  CHECK_FALSE(parse_announcement({'R', 'T', 'P', 'X'}, 0, ""));
  std::mt19937 rng(1);
  for (int k = 0; k < 20000; ++k) {
    std::vector<std::uint8_t> packet = {'R', 'T', 'P', 'S'};
    packet.resize(20 + rng() % 80);
    for (std::size_t i = 4; i < packet.size(); ++i)
      packet[i] = static_cast<std::uint8_t>(rng() % (i % 3 == 0 ? 4U : 256U));
    if (packet.size() > 40 && k % 2 == 0) {
      packet[20] = 0x15;
      packet[21] = static_cast<std::uint8_t>(4U | (rng() & 3U));
      packet[32] = 0, packet[33] = 1, packet[34] = 0, packet[35] = 0xc2;
    }
    (void)parse_announcement(packet, 0,
                             "");  // does not read beyond the end, which a sanitizer checks
  }
}

}  // namespace km
