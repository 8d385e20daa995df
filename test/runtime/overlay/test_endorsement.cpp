#include "test/runtime/overlay/overlay_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr TeamPeer kOrigin{kA, (std::uint64_t{5} << kResumeBits) + 2};

OverlayMessage some_message(OverlayStream stream) {
  return {.stream = stream, .origin = kOrigin, .to = kB, .number = 17, .content = octets(40)};
}

// Robot with keys that receives c directly; c has introduced a.
struct Receiver {
  Receiver() {
    REQUIRE(b.admit(c) == nullptr);
    overlay.connected(c.identity, 0.0);
  }
  OverlayArrival receive(OverlayMessage message) {
    return overlay.receive(c.identity, std::make_shared<const OverlayMessage>(std::move(message)),
                           0.0);
  }
  OverlayArrival introduce(const ToyMember& robot) {
    return receive({.stream = OverlayStream::kIntroduction,
                    .origin = robot.peer(),
                    .content = to_octets({robot.identity.name, robot.seal.credentials()})});
  }
  static OverlayMessage message_of(const ToyMember& robot, OverlayStream stream,
                                   std::uint32_t number = 0) {
    OverlayMessage message{.stream = stream,
                           .origin = robot.peer(),
                           .to = kB,
                           .number = number,
                           .content = octets(40)};
    endorse(message, overlay_keys(robot.seal));
    return message;
  }

  ToyTeam team;
  ToyMember a{team, kA, "alpha", kOrigin.boot}, b{team, kB, "beta"}, c{team, kC, "gamma"};
  Overlay overlay{b.peer(), overlay_keys(b.seal)};
};

TEST_CASE("The signature of a message is valid for one message of one robot only") {
  const ToyTeam team;
  const ToyMember a(team, kA, "alpha"), c(team, kC, "gamma");
  const OverlayStream stream =
      GENERATE(OverlayStream::kLinks, OverlayStream::kMemberPoses, OverlayStream::kSolver,
               OverlayStream::kBag, OverlayStream::kClosure, OverlayStream::kInlierSet,
               OverlayStream::kRequest, OverlayStream::kReply);
  CAPTURE(static_cast<int>(stream));
  const bool lasts = stream == OverlayStream::kBag || stream == OverlayStream::kReply;
  OverlayMessage message = some_message(stream);
  endorse(message, overlay_keys(a.seal));
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
  SECTION("its stream") {
    for (int other = 1; other <= static_cast<int>(OverlayStream::kInlierSet); ++other) {
      message.stream = static_cast<OverlayStream>(other);
      CHECK(holds() == (message.stream == stream));
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

TEST_CASE("An introduction is a robot name with credentials and nothing else") {
  const ToyTeam team;
  const ToyMember a(team, kA, "alpha");
  const auto text = [](const std::string& content) {
    return parse_introduction(Octets(content.begin(), content.end()));
  };
  for (const OverlayIntroduction& one :
       {OverlayIntroduction{"alpha"}, OverlayIntroduction{"alpha", a.seal.credentials()}})
    CHECK(parse_introduction(to_octets(one)) == one);
  CHECK(text(std::string(64, 'n')));
  CHECK_FALSE(text(""));
  CHECK_FALSE(text(std::string(65, 'n')));
  CHECK_FALSE(text("al\npha"));
  CHECK_FALSE(text("alpha;"));
  CHECK_FALSE(text(";" + a.seal.credentials()));
  CHECK_FALSE(text("alpha;" + a.seal.credentials() + "x"));
}

TEST_CASE("A robot out of reach is accepted only with a valid certificate of its team") {
  Receiver receiver;
  Overlay& overlay = receiver.overlay;
  const auto is_forged = [&](const ToyMember& robot, const char* why) {
    CHECK(receiver.introduce(robot) == OverlayArrival::kForged);
    CHECK(overlay.refusal() == std::string(why));
    CHECK_FALSE(overlay.robots().process(robot.peer().robot));
  };
  SECTION("a member") {
    CHECK(receiver.introduce(receiver.a) == OverlayArrival::kNew);
    CHECK(receiver.introduce(receiver.a) == OverlayArrival::kRepeated);
    REQUIRE(overlay.take_output().met.size() == 1);
    CHECK(overlay.robots().process(kA) == kOrigin);
  }
  SECTION("a member of another team") {
    const ToyTeam others("survey");
    is_forged(ToyMember(others, kA, "alpha"), "credentials of another team");
  }
  SECTION("a member with a name or boot id that it has not signed, or without credentials") {
    const std::string& shown = receiver.a.seal.credentials();
    for (const auto& [boot, introduction] :
         std::vector<std::pair<std::uint64_t, OverlayIntroduction>>{
             {kOrigin.boot, {"beta", shown}},
             {kOrigin.boot + 1, {"alpha", shown}},
             {kOrigin.boot, {"alpha"}}})
      CHECK(receiver.receive({.stream = OverlayStream::kIntroduction,
                              .origin = {kA, boot},
                              .content = to_octets(introduction)}) == OverlayArrival::kForged);
    CHECK_FALSE(overlay.robots().process(kA));
  }
  CHECK(overlay.take_output().delivered.empty());
}

TEST_CASE("A message that a neighbour forges or changes is refused before it is stored") {
  Receiver receiver;
  Overlay& overlay = receiver.overlay;
  REQUIRE(receiver.introduce(receiver.a) == OverlayArrival::kNew);
  (void)overlay.take_output();
  const std::uint64_t states = overlay.summary().states;
  const OverlayStream stream =
      GENERATE(OverlayStream::kMemberPoses, OverlayStream::kSolver, OverlayStream::kBag,
               OverlayStream::kClosure, OverlayStream::kInlierSet, OverlayStream::kRequest,
               OverlayStream::kReply);
  CAPTURE(static_cast<int>(stream));
  OverlayMessage message = Receiver::message_of(receiver.a, stream);
  SECTION("unchanged") {
    CHECK(receiver.receive(message) == OverlayArrival::kNew);
    const OverlayOutput output = overlay.take_output();
    REQUIRE(output.delivered.size() == 1);
    CHECK(output.delivered[0]->content == octets(40));
    return;
  }
  SECTION("without a signature") {
    message.content = octets(40);
    CHECK(receiver.receive(message) == OverlayArrival::kForged);
  }
  SECTION("signed by the neighbour") {
    message.content = octets(40);
    endorse(message, overlay_keys(receiver.c.seal));
    CHECK(receiver.receive(message) == OverlayArrival::kForged);
  }
  SECTION("sent by an earlier incarnation") {
    const ToyMember former(receiver.a, std::uint64_t{4} << kResumeBits);
    message = Receiver::message_of(former, stream);
    CHECK(receiver.receive(message) == OverlayArrival::kRefused);
    message.origin = kOrigin;
    CHECK(receiver.receive(message) == OverlayArrival::kForged);
  }
  CHECK(overlay.summary() == OverlaySummary{states, {{kOrigin, 0, 0}}});
  const OverlayOutput output = overlay.take_output();
  CHECK(output.delivered.empty());
  CHECK(output.packets.empty());
}

TEST_CASE("Messages of a revoked robot are refused and the robot is removed") {
  Receiver receiver;
  Overlay& overlay = receiver.overlay;
  REQUIRE(receiver.introduce(receiver.a) == OverlayArrival::kNew);
  CHECK(receiver.receive(Receiver::message_of(receiver.a, OverlayStream::kBag, 0)) ==
        OverlayArrival::kNew);
  (void)receiver.b.seal.update(receiver.team.revoking({receiver.a.keys.certificate}), kToyNow_s);
  CHECK(receiver.receive(Receiver::message_of(receiver.a, OverlayStream::kBag, 1)) ==
        OverlayArrival::kForged);
  CHECK(overlay.refusal() == std::string("certificate is revoked"));
  CHECK(overlay.summary().holds.empty());
  CHECK(overlay.take_output().delivered.size() == 1);
  CHECK(receiver.introduce(receiver.a) == OverlayArrival::kForged);
}

TEST_CASE("A revoked robot leaves the links at once, although another robot still receives it") {
  Network network(3, true);
  network.link({{kA, kB}, {kB, kC}, {kA, kC}});
  network.run(5.0);
  const Revocations list = network.team().revoking({network.member(kA).keys.certificate});
  (void)network.member(kB).seal.update(list, kToyNow_s);
  network.cut(kA, kB);
  network.run(kPeriod_s);
  CHECK(network.at(kB).robots().links().component(kB) == std::set<RobotId>{kB, kC});
  CHECK_FALSE(network.at(kB).robots().process(kA));
  CHECK(network.at(kC).robots().links().component(kC).contains(kA));
  (void)network.member(kC).seal.update(list, kToyNow_s);
  network.cut(kA, kC);
  network.run(kPeriod_s);
  CHECK(network.at(kC).robots().links().component(kC) == std::set<RobotId>{kB, kC});
}

TEST_CASE("A directly received message is stored for other robots only with its signature") {
  Receiver receiver;
  Overlay& overlay = receiver.overlay;
  const auto keep = [&](const OverlayMessage& message) {
    return message.stream == OverlayStream::kBag
               ? overlay.keep_bag(receiver.c.identity, message.number, message.content)
               : overlay.keep_reply(receiver.c.peer(), message.number, message.content);
  };
  const OverlayStream stream = GENERATE(OverlayStream::kBag, OverlayStream::kReply);
  CHECK(keep(Receiver::message_of(receiver.c, stream)) == OverlayArrival::kNew);
  OverlayMessage other = Receiver::message_of(receiver.c, stream, 1);
  other.content[0] ^= 1U;
  CHECK(keep(other) == OverlayArrival::kForged);
  other = Receiver::message_of(receiver.c, stream, 1);
  other.number = 2;
  CHECK(keep(other) == OverlayArrival::kForged);
}

TEST_CASE("Messages that a robot signed with a former key are sent again") {
  Receiver receiver;
  Overlay& overlay = receiver.overlay;
  CHECK(overlay.keep_bag(receiver.c.identity, 0,
                         Receiver::message_of(receiver.c, OverlayStream::kBag).content) ==
        OverlayArrival::kNew);
  const bool renewed = GENERATE(false, true);
  const std::uint64_t boot = next_boot(receiver.c.identity.boot);
  const ToyMember next =
      renewed ? ToyMember(receiver.team, kC, "gamma", boot) : ToyMember(receiver.c, boot);
  REQUIRE(receiver.b.admit(next) == nullptr);
  overlay.connected(next.identity, 0.0);
  CHECK(
      overlay.keep_bag(next.identity, 0, Receiver::message_of(next, OverlayStream::kBag).content) ==
      (renewed ? OverlayArrival::kNew : OverlayArrival::kRepeated));
}

TEST_CASE("A neighbour that changes forwarded messages is refused and blocks no other neighbour") {
  Network network(4, true);
  network.link(kA, kC);
  network.link(kC, kB);
  for (std::uint32_t i = 0; i < 20; ++i) network.send_bag(kA, i);
  network.at(kA).wrote(OverlayStream::kClosure, {kB}, 1, octets(700), 0.0);
  network.tamper([](OverlayMessage& message) {
    if (message.stream != OverlayStream::kIntroduction) message.content.back() ^= 1U;
  });
  network.run(20.0);
  CHECK(network.all_read(kB).empty());
  CHECK(network.refusals(kB).size() > 20);
  for (const std::string& why : network.refusals(kB))
    CHECK(why == "not signed by its origin, or changed on its way");
  // Another neighbour forwards the same messages unchanged.
  network.tamper({});
  network.run(20.0);
  CHECK(network.read(kB, OverlayStream::kBag).size() == 20);
  CHECK(network.read(kB, OverlayStream::kClosure).size() == 1);
}

}  // namespace
}  // namespace km
