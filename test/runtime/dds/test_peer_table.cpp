#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "runtime/dds/peer_table.hpp"

namespace km {
namespace {

constexpr double kLiveliness_s = 2.0;
const RobotIdentity kSelf{1, "self", kProtocolVersion, 1000};

Guid guid(std::uint8_t n) {
  Guid result{};
  result[0] = n;
  return result;
}

std::string data_of(RobotId robot, std::uint64_t boot, std::uint16_t protocol = kProtocolVersion) {
  return to_user_data({robot, "peer", protocol, boot});
}

std::vector<PeerEventKind> kinds(PeerTable& table) {
  std::vector<PeerEventKind> result;
  for (const PeerEvent& event : table.take_events()) result.push_back(event.kind);
  return result;
}

using Kinds = std::vector<PeerEventKind>;

TEST_CASE("A robot joins once its identity and its liveliness are known, in either order",
          "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  SECTION("identity first") {
    table.participant(guid(2), data_of(7, 70), "udp/10.0.0.7", 0.0);
    CHECK(kinds(table).empty());
    table.alive(guid(2), 0.1);
  }
  SECTION("liveliness first") {
    table.alive(guid(2), 0.0);
    CHECK(kinds(table).empty());
    table.participant(guid(2), data_of(7, 70), "udp/10.0.0.7", 0.1);
  }
  table.participant(guid(2), data_of(7, 70), "udp/10.0.0.7", 0.2);  // announced again
  CHECK(kinds(table) == Kinds{PeerEventKind::kJoined});
  REQUIRE(table.peers().size() == 1);
  CHECK(table.peers()[0].identity.robot == 7);
  CHECK(table.peers()[0].state == PeerState::kAlive);
  CHECK(table.peers()[0].addresses == "udp/10.0.0.7");
  CHECK(table.identity_of(guid(2))->boot == 70);
  CHECK(table.has_met(7, 70));
  CHECK_FALSE(table.has_met(7, 71));
}

TEST_CASE("Silence is a loss, sound a return, whatever happens to the lease", "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  table.participant(guid(2), data_of(7, 70), "", 0.0);
  table.alive(guid(2), 0.0);
  table.silent(guid(2));
  CHECK(kinds(table) == Kinds{PeerEventKind::kJoined, PeerEventKind::kLost});
  CHECK(table.peers()[0].state == PeerState::kLost);

  SECTION("within the lease") {
    table.alive(guid(2), 9.0);
  }
  SECTION("after the lease, as the same participant") {
    table.participant_gone(guid(2));
    CHECK(table.peers()[0].state == PeerState::kLost);
    table.participant(guid(2), data_of(7, 70), "", 99.0);
    table.alive(guid(2), 99.0);
  }
  CHECK(kinds(table) == Kinds{PeerEventKind::kReturned});
  CHECK(table.peers()[0].state == PeerState::kAlive);
}

TEST_CASE("An orderly end is not a loss", "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  table.participant(guid(2), data_of(7, 70), "", 0.0);
  table.alive(guid(2), 0.0);
  table.closed(guid(2));
  table.participant_gone(guid(2));
  CHECK(kinds(table) == Kinds{PeerEventKind::kJoined, PeerEventKind::kLeft});
  CHECK(table.peers()[0].state == PeerState::kLeft);
  CHECK(table.identity_of(guid(2)).has_value());  // what it sent may still be on its way
}

TEST_CASE("Another boot of a robot is a restart, also while the old one is still listed",
          "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  table.participant(guid(2), data_of(7, 70), "", 0.0);
  table.alive(guid(2), 0.0);
  SECTION("killed and restarted at once") {
    table.participant(guid(3), data_of(7, 71), "", 0.5);
    table.alive(guid(3), 0.5);
    table.tick(1.0);
    table.silent(guid(2));  // its former self fades
    table.tick(100.0);
    CHECK(kinds(table) == Kinds{PeerEventKind::kJoined, PeerEventKind::kRestarted});
  }
  SECTION("restarted after it was lost") {
    table.silent(guid(2));
    table.participant(guid(3), data_of(7, 71), "", 10.0);
    table.alive(guid(3), 10.0);
    table.tick(100.0);
    CHECK(kinds(table) ==
          Kinds{PeerEventKind::kJoined, PeerEventKind::kLost, PeerEventKind::kRestarted});
  }
  REQUIRE(table.peers().size() == 1);
  CHECK(table.peers()[0].identity.boot == 71);
  CHECK(table.peers()[0].state == PeerState::kAlive);
}

TEST_CASE("Two living processes with one id are a conflict, reported once", "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  table.participant(guid(2), data_of(7, 70), "", 0.0);
  table.alive(guid(2), 0.0);
  table.participant(guid(3), data_of(7, 71), "", 10.0);
  table.alive(guid(3), 10.0);
  table.tick(12.0);
  CHECK(kinds(table) == Kinds{PeerEventKind::kJoined, PeerEventKind::kRestarted});
  table.tick(13.5);
  table.tick(20.0);
  const auto events = table.take_events();
  REQUIRE(events.size() == 1);
  CHECK(events[0].kind == PeerEventKind::kConflict);
  CHECK_THAT(events[0].text, Catch::Matchers::Contains("two living processes claim robot id 7"));
}

TEST_CASE("A peer with this robot's own id is a conflict at once", "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  table.participant(guid(2), data_of(kSelf.robot, 70), "", 0.0);
  table.alive(guid(2), 0.0);
  CHECK(kinds(table) == Kinds{PeerEventKind::kConflict});
  CHECK(table.peers().empty());
}

TEST_CASE("Another protocol version and unreadable user data are refused, once", "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  const std::string data = GENERATE(data_of(7, 70, kProtocolVersion + 1), std::string("robot=x"));
  for (int i = 0; i < 3; ++i) table.participant(guid(2), data, "", i);
  table.alive(guid(2), 3.0);
  CHECK(kinds(table) == Kinds{PeerEventKind::kRefused});
  CHECK(table.peers().empty());
  CHECK_FALSE(table.identity_of(guid(2)).has_value());
  CHECK_FALSE(table.has_met(7, 70));
}

TEST_CASE("Programs that are no robots are not our business", "[peers]") {
  PeerTable table(kSelf, kLiveliness_s);
  table.participant(guid(2), "", "", 0.0);
  table.participant(guid(3), "some tool", "", 0.0);
  table.alive(guid(3), 0.0);
  table.silent(guid(3));
  table.participant_gone(guid(3));
  table.participant_gone(guid(4));
  CHECK(kinds(table).empty());
  CHECK(table.peers().empty());
}

}  // namespace
}  // namespace km
