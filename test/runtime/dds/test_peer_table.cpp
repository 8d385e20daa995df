#include "runtime/dds/peer_table.hpp"
#include "runtime/dds/robot_identity.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const RobotIdentity kSelf{1, "self", kProtocolVersion, 1000};

Guid guid(std::uint8_t n) {
  Guid result{};
  result[0] = n;
  return result;
}

std::string data_of(RobotId robot, std::uint64_t boot, std::uint16_t protocol = kProtocolVersion) {
  return to_user_data({robot, "peer", protocol, boot});
}

// Participant `from` announces itself with `data`, and its statuses arrive.
void arrive(PeerTable& table, const Guid& from, const std::string& data,
            const std::string& address = "") {
  table.participant(from, data, address);
  table.alive(from);
}

std::vector<PeerEventKind> kinds(PeerTable& table) {
  std::vector<PeerEventKind> result;
  for (const PeerEvent& event : table.take_events()) result.push_back(event.kind);
  return result;
}

using Kinds = std::vector<PeerEventKind>;

TEST_CASE(
    "A robot of an earlier process is lost until it is received, and its incarnation is known",
    "[peers]") {
  PeerTable table(kSelf);
  table.recall({7, "peer", kProtocolVersion, std::uint64_t{70} << kResumeBits});
  table.recall({kSelf.robot, "self", kProtocolVersion, 3});
  CHECK(kinds(table).empty());
  REQUIRE(table.peers().size() == 1);
  CHECK(table.peers()[0].state == PeerState::kLost);
  const auto [incarnation, resumes, kind] =
      GENERATE(Catch::Generators::table<std::uint64_t, std::uint64_t, PeerEventKind>(
          {{70, 0, PeerEventKind::kReturned},
           {70, 2, PeerEventKind::kResumed},
           {71, 0, PeerEventKind::kRestarted}}));
  arrive(table, guid(2), data_of(7, (incarnation << kResumeBits) + resumes), "udp/10.0.0.7");
  CHECK(kinds(table) == Kinds{kind});
  CHECK(table.peers()[0].state == PeerState::kAlive);
  CHECK(table.peers()[0].addresses == "udp/10.0.0.7");
}

TEST_CASE("Reports of other robots count for a robot that is not received, until it is",
          "[peers]") {
  constexpr std::uint64_t kIncarnation = std::uint64_t{70} << kResumeBits;
  constexpr std::uint64_t kOtherIncarnation = std::uint64_t{71} << kResumeBits;
  PeerTable table(kSelf);
  const auto report = [&](std::uint64_t boot) {
    table.reported({7, "peer", kProtocolVersion, boot});
  };
  table.reported({kSelf.robot, "self", kProtocolVersion, 3});
  CHECK(table.peers().empty());
  report(kIncarnation);
  const std::vector<PeerEvent> reported = table.take_events();
  REQUIRE(reported.size() == 1);
  CHECK(reported[0].kind == PeerEventKind::kReported);
  CHECK_FALSE(reported[0].direct);
  CHECK(table.peers()[0].state == PeerState::kReported);
  CHECK(table.current(7) == TeamPeer{7, kIncarnation});
  SECTION("the same again is no news") {
    report(kIncarnation);
    CHECK(kinds(table).empty());
  }
  SECTION("another process of its incarnation") {
    report(kIncarnation + 1);
    CHECK(kinds(table) == Kinds{PeerEventKind::kResumed});
    CHECK_FALSE(table.is_arriving(7));
  }
  SECTION("another incarnation waits until all nodes know") {
    report(kOtherIncarnation);
    CHECK(kinds(table) == Kinds{PeerEventKind::kRestarted});
    CHECK(table.is_arriving(7));
    table.restart_handled({7, kOtherIncarnation});
    CHECK_FALSE(table.is_arriving(7));
  }
  SECTION("it is received itself") {
    const bool restarted = GENERATE(false, true);
    CAPTURE(restarted);
    const std::uint64_t boot = restarted ? kOtherIncarnation : kIncarnation;
    arrive(table, guid(2), data_of(7, boot), "udp/10.0.0.7");
    CHECK(kinds(table) == Kinds{restarted ? PeerEventKind::kRestarted : PeerEventKind::kReturned});
    report(kIncarnation + 5);
    CHECK(kinds(table).empty());
    CHECK(table.current(7) == TeamPeer{7, boot});
    table.silent(guid(2));
    CHECK(kinds(table) == Kinds{PeerEventKind::kLost});
    report(boot);
    CHECK(kinds(table).empty());
  }
}

TEST_CASE("A robot joins once its identity and its liveliness are known, in either order",
          "[peers]") {
  PeerTable table(kSelf);
  SECTION("identity first") {
    table.participant(guid(2), data_of(7, 70), "udp/10.0.0.7");
    CHECK(kinds(table).empty());
    table.alive(guid(2));
  }
  SECTION("liveliness first") {
    table.alive(guid(2));
    CHECK(kinds(table).empty());
    table.participant(guid(2), data_of(7, 70), "udp/10.0.0.7");
  }
  table.participant(guid(2), data_of(7, 70), "udp/10.0.0.7");  // announced again
  CHECK(kinds(table) == Kinds{PeerEventKind::kJoined});
  REQUIRE(table.peers().size() == 1);
  CHECK(table.peers()[0].identity.robot == 7);
  CHECK(table.peers()[0].state == PeerState::kAlive);
  CHECK(table.peers()[0].addresses == "udp/10.0.0.7");
  CHECK(table.identity_of(guid(2))->boot == 70);
  CHECK(table.standing(guid(2)) == Standing::kAdmitted);
  CHECK(table.is_current({7, 70}));
  CHECK_FALSE(table.is_current({7, 71}));
}

const char* admit_all(const RobotIdentity& /*identity*/, std::string_view /*credentials*/) {
  return nullptr;
}

TEST_CASE("A robot that has proven its identity returns without another proof", "[peers]") {
  PeerTable table(kSelf, admit_all);
  arrive(table, guid(2), data_of(7, 70));
  CHECK(kinds(table).empty());
  CHECK(table.standing(guid(2)) == Standing::kRival);
  table.prove(guid(2), {7, 70});
  CHECK(kinds(table) == Kinds{PeerEventKind::kJoined});
  std::string announced = data_of(7, 70);
  SECTION("after its lease has ended, or a forged packet has ended it") {
    table.participant_gone(guid(2));
    CHECK(kinds(table) == Kinds{PeerEventKind::kLeft});
  }
  SECTION("after the address of this robot has changed") {
    table.network_changed();
    CHECK(kinds(table) == Kinds{PeerEventKind::kLost});
  }
  SECTION("although an announcement in its name is forged") {
    table.participant_gone(guid(2));
    CHECK(kinds(table) == Kinds{PeerEventKind::kLeft});
    announced = GENERATE(data_of(9, 90), data_of(7, 71), std::string("robot=x"), std::string());
    CAPTURE(announced);
    table.participant(guid(2), announced, "");
    const std::vector<PeerEvent> events = table.take_events();
    REQUIRE(events.size() == 1);
    CHECK(events[0].kind == PeerEventKind::kRefused);
    CHECK_THAT(events[0].text, StartsWith("forged announcements"));
    CHECK(table.forged_announcements() == 1);
    CHECK(table.identity_of(guid(2))->boot == 70);
  }
  arrive(table, guid(2), announced);
  CHECK(kinds(table) == Kinds{PeerEventKind::kReturned});
  CHECK(table.standing(guid(2)) == Standing::kAdmitted);
}

TEST_CASE("An identity under the GUID of a gone participant needs a proof of its own", "[peers]") {
  PeerTable table(kSelf, admit_all);
  arrive(table, guid(2), data_of(7, 70));
  table.participant_gone(guid(2));
  arrive(table, guid(2), data_of(9, 90));
  CHECK(kinds(table).empty());
  CHECK(table.standing(guid(2)) == Standing::kRival);
}

TEST_CASE("A robot that was first announced with forged data joins once it announces itself",
          "[peers]") {
  const bool has_keys = GENERATE(true, false);
  const std::string forged = GENERATE(std::string("liar!=3"), std::string("robot=x"),
                                      data_of(9, 90), data_of(7, 71), data_of(kSelf.robot, 5));
  CAPTURE(has_keys, forged);
  PeerTable table(kSelf, has_keys ? admit_all : PeerTable::Admit());
  arrive(table, guid(2), forged, "udp/10.0.0.7");
  (void)table.take_events();
  CHECK(table.is_current({7, 70}) == false);
  table.participant(guid(2), data_of(7, 70), "");
  table.prove(guid(2), {7, 70});
  CHECK(table.standing(guid(2)) == Standing::kAdmitted);
  CHECK(table.is_current({7, 70}));
  CHECK(table.unmet().empty());
  CHECK(table.forged_announcements() == 1);
  table.participant(guid(2), forged, "udp/10.0.0.7");
  table.prove(guid(2), {7, 70});
  CHECK(table.standing(guid(2)) == Standing::kAdmitted);
  CHECK(table.forged_announcements() == 1);
}

TEST_CASE("A participant whose statuses arrive is unmet until it is a robot of the team",
          "[peers]") {
  PeerTable table(kSelf, GENERATE(true, false) ? admit_all : PeerTable::Admit());
  const auto [data, name, why] =
      GENERATE(Catch::Generators::table<std::string, std::string, std::string>(
          {{"robot=x", "a robot at udp/10.0.0.7", "user data lacks a field"},
           {"", "a robot at udp/10.0.0.7", "it is not announced as a robot"},
           {data_of(7, 70, kProtocolVersion + 1), "peer (id 7)",
            "uses protocol version " + std::to_string(kProtocolVersion + 1) + ", this robot " +
                std::to_string(kProtocolVersion)}}));
  table.participant(guid(2), data, "udp/10.0.0.7");
  CHECK(table.unmet().empty());
  CHECK_FALSE(table.is_isolated());
  table.alive(guid(2));
  CHECK(table.receives_strangers());
  CHECK(table.unmet() == std::map<std::string, std::string>{{name, why}});
  table.participant(guid(2), data_of(7, 70), "");
  table.prove(guid(2), {7, 70});
  CHECK(table.unmet().empty());
}

TEST_CASE("A robot is isolated while robots are announced and none is received", "[peers]") {
  PeerTable table(kSelf);
  table.participant(guid(2), data_of(7, 70), "");
  CHECK(table.is_isolated());
  CHECK_FALSE(table.receives_strangers());
  CHECK_THAT(table.unmet().begin()->second, Contains("does not receive it (firewall, NAT"));
  table.alive(guid(2));
  CHECK_FALSE(table.is_isolated());
  table.silent(guid(2));
  CHECK_FALSE(table.is_isolated());
}

TEST_CASE("A robot without keys ignores one that has keys and the same id", "[peers]") {
  PeerTable table(kSelf);
  arrive(table, guid(2), to_user_data({kSelf.robot, "peer", kProtocolVersion, 70}, "abc"));
  table.twin_received(guid(2), 100.0, 2.0);
  CHECK(kinds(table) == Kinds{PeerEventKind::kRefused});
  CHECK(table.standing(guid(2)) == Standing::kOutsider);
}

constexpr std::uint64_t kBoot = 70U << kResumeBits;
constexpr std::uint64_t kOtherIncarnation = 71U << kResumeBits;

// Robot 7, received from guid 2, with kBoot.
PeerTable with_robot() {
  PeerTable table(kSelf);
  arrive(table, guid(2), data_of(7, kBoot), "udp/10.0.0.7");
  REQUIRE(kinds(table) == Kinds{PeerEventKind::kJoined});
  return table;
}

TEST_CASE("A robot that is started again has its id back once its former self is missed",
          "[peers]") {
  const auto [boot, kind] = GENERATE(Catch::Generators::table<std::uint64_t, PeerEventKind>(
      {{kOtherIncarnation, PeerEventKind::kRestarted}, {kBoot + 1, PeerEventKind::kResumed}}));
  PeerTable table = with_robot();
  SECTION("killed and restarted at once") {
    arrive(table, guid(3), data_of(7, boot));
    CHECK(table.standing(guid(3)) == Standing::kRival);
    CHECK(kinds(table) == Kinds{PeerEventKind::kRefused});
    table.silent(guid(2));
  }
  SECTION("restarted after it was lost") {
    table.silent(guid(2));
    table.participant(guid(3), data_of(7, boot), "");
    CHECK(table.standing(guid(3)) == Standing::kRival);  // not received itself yet
    table.alive(guid(3));
  }
  SECTION("restarted after it left") {
    table.closed(guid(2));
    table.participant_gone(guid(2));
    CHECK(table.standing(guid(2)) == Standing::kAdmitted);  // its messages may still arrive
    CHECK(kinds(table) == Kinds{PeerEventKind::kLeft});
    arrive(table, guid(3), data_of(7, boot));
  }
  const Kinds events = kinds(table);
  REQUIRE_FALSE(events.empty());
  CHECK(events.back() == kind);
  REQUIRE(table.peers().size() == 1);
  CHECK(table.peers()[0].identity.boot == boot);
  CHECK(table.peers()[0].state == PeerState::kAlive);
  if (kind == PeerEventKind::kRestarted) {
    CHECK(table.standing(guid(3)) == Standing::kArriving);
    table.restart_handled({7, kBoot});  // late, for the former incarnation
    CHECK(table.standing(guid(3)) == Standing::kArriving);
    table.restart_handled({7, boot});
  }
  CHECK(table.standing(guid(3)) == Standing::kAdmitted);
  CHECK(table.is_current({7, boot}));
  CHECK_FALSE(table.is_current({7, kBoot}));
  CHECK(table.standing(guid(2)) != Standing::kAdmitted);
}

TEST_CASE("No participant takes over the id of a present robot", "[peers]") {
  PeerTable table = with_robot();
  // That of the robot itself is no secret.
  const std::uint64_t boot = GENERATE(as<std::uint64_t>{}, kBoot, kBoot + 1, kOtherIncarnation);
  for (int i = 0; i < 3; ++i) arrive(table, guid(3), data_of(7, boot), "udp/10.0.0.66");
  const auto events = table.take_events();
  REQUIRE(events.size() == 1);
  CHECK(events[0].kind == PeerEventKind::kRefused);
  CHECK_THAT(events[0].text, Contains("udp/10.0.0.66"));
  CHECK(table.standing(guid(3)) == Standing::kRival);
  CHECK(table.standing(guid(2)) == Standing::kAdmitted);
  CHECK(table.peers()[0].identity.boot == kBoot);

  table.closed(guid(3));
  CHECK(table.take_events().empty());
  table.silent(guid(2));
  CHECK(kinds(table) == Kinds{PeerEventKind::kLost});
  table.alive(guid(2));
  CHECK(kinds(table) == Kinds{PeerEventKind::kReturned});
}

TEST_CASE("With keys a former process does not get its id back", "[peers]") {
  PeerTable table(kSelf, admit_all);
  const auto receive = [&](const Guid& from, std::uint64_t boot) {
    arrive(table, from, data_of(7, boot), "udp/10.0.0.66");
    table.prove(from, {7, boot});
  };
  const std::uint64_t former = GENERATE(kBoot, kOtherIncarnation);
  receive(guid(2), former);
  table.silent(guid(2));
  receive(guid(3), kBoot + 1);
  CHECK(table.is_current({7, kBoot + 1}));
  (void)table.take_events();
  const bool was_silent = GENERATE(true, false);
  const Guid other = GENERATE(guid(2), guid(4));
  if (was_silent) table.silent(guid(3));
  receive(other, former);
  const std::vector<PeerEvent> events = table.take_events();
  REQUIRE_FALSE(events.empty());
  CHECK(events.back().kind == PeerEventKind::kRefused);
  CHECK_THAT(events.back().text, Contains("start it again"));
  if (!was_silent) table.silent(guid(3));
  CHECK(table.is_current({7, kBoot + 1}));
  table.reported({7, "peer", kProtocolVersion, former});
  CHECK(table.is_current({7, kBoot + 1}));
  CHECK(table.peers()[0].state == PeerState::kLost);
  table.alive(guid(3));
  CHECK(table.peers()[0].state == PeerState::kAlive);
  table.silent(guid(3));
  receive(guid(5), kBoot + 2);
  CHECK(table.is_current({7, kBoot + 2}));
}

// Events of a process that receives another one with its id every half second.
std::vector<PeerEvent> meet_twin(const RobotIdentity& self, const RobotIdentity& twin, double own_s,
                                 double its_s, double seconds) {
  PeerTable table(self);
  arrive(table, guid(2), to_user_data(twin), "udp/10.0.0.66");
  CHECK(table.standing(guid(2)) == Standing::kTwin);
  for (double s = 0.0; s <= seconds; s += 0.5) table.twin_received(guid(2), its_s + s, own_s + s);
  CHECK(table.peers().empty());
  return table.take_events();
}

TEST_CASE("The newer of two processes with this robot's id yields", "[peers]") {
  struct Case {
    const char* what;
    double its_s, own_s;
    PeerEventKind expected;
  };
  const auto [what, its_s, own_s, expected] =
      GENERATE(values({Case{"it is older", 100.0, 2.0, PeerEventKind::kConflict},
                       Case{"it is younger", 2.0, 8.0, PeerEventKind::kRefused},
                       Case{"it reports that it is older, to one that is not new", 1e6, 11.0,
                            PeerEventKind::kRefused}}));
  CAPTURE(what);
  const std::uint64_t its_boot = GENERATE(as<std::uint64_t>(), 70, 7000);
  const auto events = meet_twin(kSelf, {1, "twin", kProtocolVersion, its_boot}, own_s, its_s, 30.0);
  REQUIRE(events.size() == 1);
  CHECK(events[0].kind == expected);
  CHECK_THAT(events[0].text, Contains("give every robot its own --robot"));
}

TEST_CASE("One of two processes with one id ends, whichever errors they measure with", "[peers]") {
  // Each measures the other uptime too small by up to a second.
  const double late_s = GENERATE(0.0, 0.4, 0.9);
  const double later_s = GENERATE(0.0, 0.4, 0.9);
  const RobotIdentity low{1, "a", kProtocolVersion, 70}, high{1, "b", kProtocolVersion, 7000};
  for (double lead_s = -8.0; lead_s <= 8.0; lead_s += 0.25) {  // lead of `low`
    const double low_s = 1.0 + std::max(lead_s, 0.0), high_s = 1.0 + std::max(-lead_s, 0.0);
    CAPTURE(late_s, later_s, lead_s);
    const auto yields = [&](const RobotIdentity& self, const RobotIdentity& twin, double own_s,
                            double its_s, double seconds) {
      const auto events = meet_twin(self, twin, own_s, its_s, seconds);
      REQUIRE_FALSE(events.empty());
      return events.back().kind == PeerEventKind::kConflict;
    };
    const bool low_ends_first = yields(low, high, low_s, high_s - late_s, 2.0);
    const bool high_ends_first = yields(high, low, high_s, low_s - later_s, 2.0);
    CHECK_FALSE((low_ends_first && high_ends_first));
    if (low_ends_first || high_ends_first) continue;
    CHECK_FALSE(yields(low, high, low_s, high_s - late_s, 30.0));
    CHECK(yields(high, low, high_s, low_s - later_s, 30.0));
  }
}

Guid wide_guid(std::size_t n) {
  Guid result{};
  for (std::size_t k = 0; k < 4; ++k) result[k + 1] = static_cast<std::uint8_t>(n >> (8 * k));
  return result;
}

// Announces more participants than a table remembers. Their number and whether they are alive is
// free to choose for any program.
void announce_strangers(PeerTable& table, const std::string& data, bool alive) {
  for (std::size_t n = 0; n < 3 * PeerTable::kMaxParticipants; ++n) {
    table.participant(wide_guid(n), data, "");
    if (alive) table.alive(wide_guid(n));
  }
  (void)table.take_events();
}

TEST_CASE("Participants outside the team do not take the place of a robot, however many they are",
          "[peers]") {
  const bool has_keys = GENERATE(true, false);
  const bool alive = GENERATE(true, false);
  // A program, a robot without a status writer, and the recorded announcement of a robot.
  const std::string strangers = GENERATE(std::string("some tool"), data_of(9, 90), data_of(7, 70));
  if (alive && strangers == data_of(7, 70) && !has_keys) return;  // owner of the id
  CAPTURE(has_keys, alive, strangers);
  PeerTable table(kSelf, has_keys ? admit_all : PeerTable::Admit());
  const auto announce = [&] { table.participant(guid(2), data_of(7, 70), ""); };
  const auto be_alive = [&] {
    table.alive(guid(2));
    if (!table.is_announced(guid(2))) announce();
    table.prove(guid(2), {7, 70});
  };
  SECTION("before it comes") {
    announce_strangers(table, strangers, alive);
    announce();
    be_alive();
  }
  SECTION("after it is announced") {
    announce();
    announce_strangers(table, strangers, alive);
    be_alive();
  }
  SECTION("before it returns") {
    announce();
    be_alive();
    table.silent(guid(2));
    table.participant_gone(guid(2));
    announce_strangers(table, strangers, has_keys && alive);
    CHECK(table.identity_of(guid(2)).has_value());
    announce();
    be_alive();
  }
  CHECK(table.standing(guid(2)) == Standing::kAdmitted);
  CHECK(table.is_current({7, 70}));
  CHECK(table.peers().front().state == PeerState::kAlive);
}

TEST_CASE("A new robot takes the place of the one that has been lost for longest", "[peers]") {
  PeerTable table(kSelf);
  const auto receive = [&](std::size_t n, std::uint64_t boot) {
    arrive(table, wide_guid(n), data_of(static_cast<RobotId>(n), boot));
  };
  const std::size_t end = 100 + PeerTable::kMaxRobots;
  for (std::size_t n = 100; n < end; ++n) receive(n, n);
  receive(7, 70);
  CHECK(table.standing(wide_guid(7)) == Standing::kRival);
  (void)table.take_events();
  table.silent(wide_guid(120));
  auto events = table.take_events();
  REQUIRE(events.size() == 3);
  CHECK(events[0].kind == PeerEventKind::kLost);
  CHECK(events[1].kind == PeerEventKind::kRestarted);
  CHECK(events[1].identity.robot == 120);
  CHECK(events[1].identity.boot == 0);
  CHECK_FALSE(events[1].direct);
  CHECK(events[2].kind == PeerEventKind::kJoined);
  CHECK(table.is_current({7, 70}));

  table.silent(wide_guid(140));
  table.silent(wide_guid(130));
  table.alive(wide_guid(120));
  events = table.take_events();
  REQUIRE(events.size() == 4);
  CHECK(events[2].identity.robot == 140);
  CHECK(events[3].kind == PeerEventKind::kJoined);
  CHECK(table.is_current({120, 120}));
  table.alive(wide_guid(130));
  CHECK(kinds(table) == Kinds{PeerEventKind::kReturned});
  CHECK(table.peers().size() == PeerTable::kMaxRobots);
}

TEST_CASE("Another protocol version and unreadable user data are refused, once", "[peers]") {
  PeerTable table(kSelf);
  const std::string data = GENERATE(data_of(7, 70, kProtocolVersion + 1), std::string("robot=x"));
  for (int i = 0; i < 3; ++i) table.participant(guid(2), data, "");
  table.alive(guid(2));
  CHECK(kinds(table) == Kinds{PeerEventKind::kRefused});
  CHECK(table.peers().empty());
  CHECK_FALSE(table.identity_of(guid(2)).has_value());
  CHECK(table.standing(guid(2)) == Standing::kOutsider);
}

}  // namespace
}  // namespace km
