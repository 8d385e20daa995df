#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "test/modules/relay/relay_network.hpp"

namespace km {
namespace {

constexpr TeamPeer kOrigin{kA, (std::uint64_t{5} << kResumeBits) + 2};

RelayMessage some_message(RelayKind kind) {
  return {.kind = kind, .origin = kOrigin, .to = kB, .number = 17, .content = octets(40)};
}

// Robot with keys that receives c directly; c has introduced a.
struct Receiver {
  Receiver() {
    REQUIRE(b.admit(c) == nullptr);
    store.connected(c.identity);
  }
  RelayArrival receive(RelayMessage message) {
    return store.receive({kC, std::make_shared<const RelayMessage>(std::move(message))});
  }
  RelayArrival introduce(const ToyMember& robot) {
    return receive({.kind = RelayKind::kIntroduction,
                    .origin = robot.peer(),
                    .content = to_octets({robot.identity.name, robot.seal.credentials()})});
  }
  static RelayMessage message_of(const ToyMember& robot, RelayKind kind, std::uint32_t number = 0) {
    RelayMessage message{
        .kind = kind, .origin = robot.peer(), .to = kB, .number = number, .content = octets(40)};
    endorse(message, relay_keys(robot.seal));
    return message;
  }

  ToyTeam team;
  ToyMember a{team, kA, "alpha", kOrigin.boot}, b{team, kB, "beta"}, c{team, kC, "gamma"};
  RelayStore store{b.peer(), relay_keys(b.seal)};
};

TEST_CASE("A relay signature is valid for one message of one robot only", "[relay]") {
  const ToyTeam team;
  const ToyMember a(team, kA, "alpha"), c(team, kC, "gamma");
  const RelayKind kind = GENERATE(RelayKind::kBag, RelayKind::kClosure, RelayKind::kInlierSet,
                                  RelayKind::kRequest, RelayKind::kReply);
  CAPTURE(static_cast<int>(kind));
  const bool lasts = kind == RelayKind::kBag || kind == RelayKind::kReply;
  RelayMessage message = some_message(kind);
  endorse(message, relay_keys(a.seal));
  REQUIRE(message.content.size() == 40 + kEndorsementBytes);
  const auto holds = [&] { return is_endorsed(message, a.keys.certificate.key); };
  REQUIRE(holds());
  CHECK_FALSE(is_endorsed(message, c.keys.certificate.key));
  SECTION("each byte of the content") {
    for (std::uint8_t& octet : message.content) {
      octet ^= 1U;
      CHECK_FALSE(holds());
      octet ^= 1U;
    }
    message.content.pop_back();
    CHECK_FALSE(holds());
    message.content.clear();
    CHECK_FALSE(holds());
  }
  SECTION("its kind") {
    for (int other = 1; other <= static_cast<int>(RelayKind::kReply); ++other) {
      message.kind = static_cast<RelayKind>(other);
      CHECK(holds() == (message.kind == kind));
    }
  }
  SECTION("its origin and number") {
    message.origin.robot = kC;
    CHECK_FALSE(holds());
    message.origin.robot = kA;
    ++message.number;
    CHECK_FALSE(holds());
  }
  SECTION("the incarnation of the origin, and its boot id unless the message is valid longer") {
    message.origin.boot = next_boot(kOrigin.boot);
    CHECK(holds() == lasts);
    message.origin.boot = kOrigin.boot + (std::uint64_t{1} << kResumeBits);
    CHECK_FALSE(holds());
  }
  SECTION("the addressee unless the message is for any requester") {
    message.to = kD;
    CHECK(holds() == lasts);
    message.to = kB;
    message.to_boot = 5;
    CHECK(holds() == lasts);
  }
  SECTION("not the number of hops") {
    message.hops = 9;
    CHECK(holds());
  }
}

TEST_CASE("An introduction is a robot name with credentials and nothing else", "[relay]") {
  const ToyTeam team;
  const ToyMember a(team, kA, "alpha");
  const auto text = [](const std::string& content) {
    return parse_introduction(Octets(content.begin(), content.end()));
  };
  for (const RelayIntroduction& one :
       {RelayIntroduction{"alpha"}, RelayIntroduction{"alpha", a.seal.credentials()}})
    CHECK(parse_introduction(to_octets(one)) == one);
  CHECK(text(std::string(64, 'n')));
  CHECK_FALSE(text(""));
  CHECK_FALSE(text(std::string(65, 'n')));
  CHECK_FALSE(text("al\npha"));
  CHECK_FALSE(text("alpha;"));
  CHECK_FALSE(text(";" + a.seal.credentials()));
  CHECK_FALSE(text("alpha;" + a.seal.credentials() + "x"));
}

TEST_CASE("A robot out of reach is accepted only with a valid certificate of its team", "[relay]") {
  Receiver receiver;
  RelayStore& store = receiver.store;
  const auto is_forged = [&](const ToyMember& robot, const char* why) {
    CHECK(receiver.introduce(robot) == RelayArrival::kForged);
    CHECK(store.refusal() == std::string(why));
    CHECK_FALSE(store.origin(robot.peer().robot));
  };
  SECTION("a member") {
    CHECK(receiver.introduce(receiver.a) == RelayArrival::kNew);
    CHECK(receiver.introduce(receiver.a) == RelayArrival::kRepeated);
    REQUIRE(store.take_output().met.size() == 1);
    CHECK(store.origin(kA) == kOrigin);
  }
  SECTION("a member of another team") {
    const ToyTeam others("survey");
    is_forged(ToyMember(others, kA, "alpha"), "credentials of another team");
  }
  SECTION("a revoked member") {
    (void)receiver.b.seal.update(receiver.team.revoking({receiver.a.keys.certificate}), kToyNow_s);
    is_forged(receiver.a, "certificate is revoked");
  }
  SECTION("a member with a name or boot id that it has not signed, or without credentials") {
    const std::string& shown = receiver.a.seal.credentials();
    for (const auto& [boot, introduction] :
         std::vector<std::pair<std::uint64_t, RelayIntroduction>>{
             {kOrigin.boot, {"beta", shown}},
             {kOrigin.boot + 1, {"alpha", shown}},
             {kOrigin.boot, {"alpha"}}})
      CHECK(receiver.receive({.kind = RelayKind::kIntroduction,
                              .origin = {kA, boot},
                              .content = to_octets(introduction)}) == RelayArrival::kForged);
    CHECK_FALSE(store.origin(kA));
  }
  CHECK(store.take_output().delivered.empty());
}

TEST_CASE("A message that a neighbour forges or changes is refused before it is stored",
          "[relay]") {
  Receiver receiver;
  RelayStore& store = receiver.store;
  REQUIRE(receiver.introduce(receiver.a) == RelayArrival::kNew);
  (void)store.take_output();
  const RelayKind kind = GENERATE(RelayKind::kBag, RelayKind::kClosure, RelayKind::kInlierSet,
                                  RelayKind::kRequest, RelayKind::kReply);
  CAPTURE(static_cast<int>(kind));
  RelayMessage message = Receiver::message_of(receiver.a, kind);
  SECTION("unchanged") {
    CHECK(receiver.receive(message) == RelayArrival::kNew);
    const RelayOutput output = store.take_output();
    REQUIRE(output.delivered.size() == 1);
    CHECK(output.delivered[0]->content == octets(40));
    return;
  }
  SECTION("changed") {
    message.content[3] ^= 1U;
    CHECK(receiver.receive(message) == RelayArrival::kForged);
  }
  SECTION("without a signature") {
    message.content = octets(40);
    CHECK(receiver.receive(message) == RelayArrival::kForged);
  }
  SECTION("signed by the neighbour") {
    message.content = octets(40);
    endorse(message, relay_keys(receiver.c.seal));
    CHECK(receiver.receive(message) == RelayArrival::kForged);
  }
  SECTION("under another number") {
    message.number = 3;
    CHECK(receiver.receive(message) == RelayArrival::kForged);
  }
  SECTION("sent by an earlier incarnation") {
    const ToyMember former(receiver.a, std::uint64_t{4} << kResumeBits);
    message = Receiver::message_of(former, kind);
    CHECK(receiver.receive(message) == RelayArrival::kRefused);
    message.origin = kOrigin;
    CHECK(receiver.receive(message) == RelayArrival::kForged);
  }
  CHECK(store.summary().holds == std::vector<RelayHeld>{{kOrigin, 0, 0}});
  const RelayOutput output = store.take_output();
  CHECK(output.delivered.empty());
  CHECK(output.packets.empty());
}

TEST_CASE("Messages of a revoked robot are refused and the robot is removed", "[relay]") {
  Receiver receiver;
  RelayStore& store = receiver.store;
  REQUIRE(receiver.introduce(receiver.a) == RelayArrival::kNew);
  CHECK(receiver.receive(Receiver::message_of(receiver.a, RelayKind::kBag, 0)) ==
        RelayArrival::kNew);
  (void)receiver.b.seal.update(receiver.team.revoking({receiver.a.keys.certificate}), kToyNow_s);
  CHECK(receiver.receive(Receiver::message_of(receiver.a, RelayKind::kBag, 1)) ==
        RelayArrival::kForged);
  CHECK(store.refusal() == std::string("certificate is revoked"));
  CHECK(store.summary().holds.empty());
  CHECK(store.take_output().delivered.size() == 1);
  CHECK(receiver.introduce(receiver.a) == RelayArrival::kForged);
}

TEST_CASE("A directly received message is stored for other robots only with its signature",
          "[relay]") {
  Receiver receiver;
  RelayStore& store = receiver.store;
  const auto keep = [&](const RelayMessage& message) {
    return message.kind == RelayKind::kBag
               ? store.keep_bag(receiver.c.identity, message.number, message.content)
               : store.keep_reply(receiver.c.peer(), message.number, message.content);
  };
  const RelayKind kind = GENERATE(RelayKind::kBag, RelayKind::kReply);
  CHECK(keep(Receiver::message_of(receiver.c, kind)) == RelayArrival::kNew);
  RelayMessage other = Receiver::message_of(receiver.c, kind, 1);
  other.content[0] ^= 1U;
  CHECK(keep(other) == RelayArrival::kForged);
  other = Receiver::message_of(receiver.c, kind, 1);
  other.number = 2;
  CHECK(keep(other) == RelayArrival::kForged);
}

TEST_CASE("Messages that a robot signed with a former key are sent again", "[relay]") {
  Receiver receiver;
  RelayStore& store = receiver.store;
  CHECK(store.keep_bag(receiver.c.identity, 0,
                       Receiver::message_of(receiver.c, RelayKind::kBag).content) ==
        RelayArrival::kNew);
  const bool renewed = GENERATE(false, true);
  const std::uint64_t boot = next_boot(receiver.c.identity.boot);
  const ToyMember next =
      renewed ? ToyMember(receiver.team, kC, "gamma", boot) : ToyMember(receiver.c, boot);
  REQUIRE(receiver.b.admit(next) == nullptr);
  store.connected(next.identity);
  CHECK(store.keep_bag(next.identity, 0, Receiver::message_of(next, RelayKind::kBag).content) ==
        (renewed ? RelayArrival::kNew : RelayArrival::kRepeated));
}

TEST_CASE("A neighbour that changes forwarded messages is refused and blocks no other neighbour",
          "[relay]") {
  Network network(4, true);
  network.link(kA, kC);
  network.link(kC, kB);
  for (std::uint32_t i = 0; i < 20; ++i) network.send_bag(kA, i);
  network.at(kA).wrote(RelayKind::kClosure, {kB}, 1, octets(700), 0.0);
  network.tamper([](RelayMessage& message) {
    if (message.kind != RelayKind::kIntroduction) message.content.back() ^= 1U;
  });
  network.run(20.0);
  CHECK(network.all_read(kB).empty());
  CHECK(network.refusals(kB).size() > 20);
  for (const std::string& why : network.refusals(kB))
    CHECK(why == "not signed by its origin, or changed on its way");
  // Another neighbour forwards the same messages unchanged.
  network.tamper({});
  network.run(20.0);
  CHECK(network.read(kB, RelayKind::kBag).size() == 20);
  CHECK(network.read(kB, RelayKind::kClosure).size() == 1);
}

}  // namespace
}  // namespace km
