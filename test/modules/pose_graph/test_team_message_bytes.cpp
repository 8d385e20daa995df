#include <catch2/catch.hpp>

#include <limits>
#include <random>

#include "modules/core/bytes.hpp"
#include "modules/pose_graph/team_message_bytes.hpp"
#include "modules/pose_graph/team_notices.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr TeamPeer kPeer2{2, 0x1122334455667788};
constexpr TeamPeer kPeer7{7, 0x8877665544332211};
constexpr TeamPeer kPeer60000{60000, 1};

TeamStatus some_status() {
  std::mt19937 random(1);
  return {
      .sender = kPeer7,
      .frame = kPeer2,
      .frame_version = 5,
      .keyframes = 1000,
      .revision = 1007,
      .offers = {{2, 12, {3, 0xABCDEF0123456789}, 3}, {2, 9, {2, 5}, 1, true}, {60000, 1, {1, 77}}},
      .method = PgoMethod::kRbcd,
      .T_odom_first = random_pose(random, 2.0),
      .upright = true};
}

Session some_session() {
  std::mt19937 random(2);
  return {.id = {kPeer2, 9},
          .plan = {.frame = kPeer7,
                   .members = {{kPeer7, 1007, RobotId{2}, 77},
                               {kPeer2, 4, {}},
                               {kPeer60000, 9, RobotId{7}}},
                   .pairs = {{2, 7, {3, 5}}, {2, 60000, {1, 6}}, {7, 60000, {2, 7}}}},
          .method = PgoMethod::kNewton,
          .upright = true,
          .max_rounds = 50,
          .anchor = 7,
          .T_frame_world = random_pose(random, 2.0),
          .round = 3,
          .cost = 1.0 / 3.0,
          .gradient = 1e-9,
          .finished = true};
}

MemberPoses some_poses() {
  std::mt19937 random(3);
  MemberPoses poses{.sender = kPeer7,
                    .session = {kPeer2, 9},
                    .stage = MemberStage::kSolved,
                    .frame = kPeer2,
                    .frame_version = 8,
                    .step_precision = {123.456, 7.0},
                    .keyframes = {0, 1, 5, 200, 4'000'000'000U}};
  for (std::size_t k = 0; k < poses.keyframes.size(); ++k)
    poses.T_frame_kf.push_back(SinglePose::of(random_pose(random, 100.0)));
  poses.verdicts = {{closure_id({7, 200}, {2, 3}), true}, {closure_id({7, 5}, {60000, 9}), false}};
  poses.sent_bytes = 5'000'000'000;
  return poses;
}

ReliableMessage some_reliable_message() {
  return {.sender = kPeer60000,
          .session = {kPeer2, 9},
          .number = 130,
          .to = 7,
          .bytes = std::make_shared<const Bytes>(Bytes{0, 1, 2, 255}),
          .received = 129};
}

std::vector<TeamMessage> one_of_each() {
  return {some_status(), some_session(), some_poses(), some_reliable_message()};
}

// Decodes what the network knows of `message` with other bytes.
Decoded<TeamMessage> decoded_as(const TeamMessage& message, std::span<const std::uint8_t> bytes) {
  const auto* reliable = std::get_if<ReliableMessage>(&message);
  return decode_team_message({.kind = kind_of(message),
                              .sender = origin_of(message),
                              .to = reliable == nullptr ? RobotId{0} : reliable->to,
                              .bytes = bytes});
}

template <typename T>
T round_trip(const T& message) {
  auto result = decoded_as(message, encode(message));
  CAPTURE(result.refusal == nullptr ? "" : result.refusal);
  REQUIRE(result.value);
  return std::get<T>(std::move(*result.value));
}

const char* refusal_of(const TeamMessage& message) {
  const auto result = decoded_as(message, encode(message));
  return result.value ? "" : result.refusal;
}

constexpr double kRounding = 1e-14;  // rotation sent as a quaternion

TEST_CASE("Decoding restores an encoded status", "[pose_graph]") {
  const TeamStatus sent = some_status();
  const TeamStatus received = round_trip(sent);
  CHECK(received.sender == sent.sender);
  CHECK(received.frame == sent.frame);
  CHECK(received.frame_version == sent.frame_version);
  CHECK(received.keyframes == sent.keyframes);
  CHECK(received.revision == sent.revision);
  CHECK(received.offers == sent.offers);
  CHECK(received.method == sent.method);
  CHECK(received.T_odom_first.isApprox(sent.T_odom_first, kRounding));
  CHECK(received.upright == sent.upright);
}

TEST_CASE("Decoding restores an encoded session", "[pose_graph]") {
  Session sent = some_session();
  const Session received = round_trip(sent);
  CHECK(received.id == sent.id);
  CHECK(received.plan == sent.plan);
  CHECK(received.method == sent.method);
  CHECK(received.upright == sent.upright);
  CHECK(received.max_rounds == sent.max_rounds);
  CHECK(received.anchor == sent.anchor);
  REQUIRE(received.T_frame_world);
  CHECK(received.T_frame_world->isApprox(*sent.T_frame_world, kRounding));
  CHECK(received.round == sent.round);
  CHECK(received.cost == sent.cost);
  CHECK(received.gradient == sent.gradient);
  CHECK(received.finished == sent.finished);
  sent.T_frame_world.reset();
  CHECK_FALSE(round_trip(sent).T_frame_world);
}

TEST_CASE("Decoding restores poses of a member to the last bit, from 29 bytes each",
          "[pose_graph]") {
  const MemberPoses sent = some_poses();
  const MemberPoses received = round_trip(sent);
  CHECK(received.sender == sent.sender);
  CHECK(received.session == sent.session);
  CHECK(received.stage == sent.stage);
  CHECK(received.frame == sent.frame);
  CHECK(received.frame_version == sent.frame_version);
  CHECK(received.step_precision.kappa == sent.step_precision.kappa);
  CHECK(received.step_precision.tau == sent.step_precision.tau);
  CHECK(received.keyframes == sent.keyframes);
  REQUIRE(received.T_frame_kf.size() == sent.T_frame_kf.size());
  for (std::size_t k = 0; k < sent.T_frame_kf.size(); ++k) {
    CHECK(received.T_frame_kf[k].q.coeffs() == sent.T_frame_kf[k].q.coeffs());
    CHECK(received.T_frame_kf[k].t == sent.T_frame_kf[k].t);
  }
  REQUIRE(received.verdicts.size() == sent.verdicts.size());
  for (std::size_t k = 0; k < sent.verdicts.size(); ++k) {
    CHECK(received.verdicts[k].id == sent.verdicts[k].id);
    CHECK(received.verdicts[k].kept == sent.verdicts[k].kept);
  }
  CHECK(received.sent_bytes == sent.sent_bytes);

  MemberPoses many = sent;
  many.keyframes.clear();
  many.verdicts.clear();
  for (KeyframeIndex k = 0; k < 1000; ++k) many.keyframes.push_back(3 * k);
  many.T_frame_kf.assign(1000, sent.T_frame_kf[0]);
  CHECK(encode(many).size() < 29 * 1000 + 80);
}

TEST_CASE("Decoding restores an encoded reliable message", "[pose_graph]") {
  ReliableMessage sent = some_reliable_message();
  const ReliableMessage received = round_trip(sent);
  CHECK(received.sender == sent.sender);
  CHECK(received.session == sent.session);
  CHECK(received.number == sent.number);
  CHECK(received.to == sent.to);
  CHECK(received.received == sent.received);
  REQUIRE(received.bytes);
  CHECK(*received.bytes == *sent.bytes);
  sent.bytes = nullptr;
  CHECK(round_trip(sent).bytes->empty());
}

TEST_CASE("Empty messages are valid", "[pose_graph]") {
  CHECK(round_trip(TeamStatus{.sender = kPeer2, .frame = kPeer2}).offers.empty());
  CHECK(round_trip(MemberPoses{.sender = kPeer2}).keyframes.empty());
}

TEST_CASE("Decoding accepts every encoded message and uses it to the last byte", "[pose_graph]") {
  for (const TeamMessage& message : one_of_each()) {
    CAPTURE(message.index());
    const Bytes bytes = encode(message);
    const auto again = decoded_as(message, bytes);
    REQUIRE(again.value);
    CHECK(again.value->index() == message.index());
    // The first decoding may round a rotation; afterwards its double is unchanged.
    CHECK(encode(*again.value).size() == bytes.size());
  }
}

TEST_CASE("No truncated message is accepted", "[pose_graph]") {
  for (const TeamMessage& message : one_of_each()) {
    const bool is_reliable = std::holds_alternative<ReliableMessage>(message);
    const Bytes bytes = encode(message);
    // The content of a reliable message may have any length.
    const std::size_t end =
        is_reliable ? bytes.size() - some_reliable_message().bytes->size() : bytes.size();
    for (std::size_t size = 0; size < end; ++size) {
      CAPTURE(message.index(), size);
      const auto result = decoded_as(message, std::span(bytes).first(size));
      CHECK_FALSE(result.value);
      CHECK(result.refusal != nullptr);
    }
    if (is_reliable) continue;
    Bytes longer = bytes;
    longer.push_back(0);
    CHECK_FALSE(decoded_as(message, longer).value);
  }
}

TEST_CASE("Impossible counts are refused before memory is allocated", "[pose_graph]") {
  ByteWriter out;
  out.varint(7);  // poses
  out.u64(1);
  out.varint(3);
  out.varint(1);
  out.varint(7);
  out.u64(1);
  out.varint(0);
  out.f64(1.0);
  out.f64(1.0);
  out.varint(GENERATE(std::uint64_t{kMaxPublicPoses}, std::uint64_t{kMaxPublicPoses} + 1,
                      std::numeric_limits<std::uint64_t>::max()));
  out.bytes(Bytes(1000, 0));
  CHECK_FALSE(decoded_as(some_poses(), out.release()).value);
}

TEST_CASE("An inconsistent status is refused", "[pose_graph]") {
  TeamStatus m = some_status();
  SECTION("offers out of order") {
    std::swap(m.offers[0], m.offers[2]);
  }
  SECTION("an offer to itself") {
    m.offers[0].peer = m.sender.robot;
  }
  SECTION("an offer without edges") {
    m.offers[0].edges = 0;
  }
  SECTION("a method that is not known") {
    m.method = static_cast<PgoMethod>(200);
  }
  SECTION("an odometry origin that is not finite") {
    m.T_odom_first.translation().x() = std::numeric_limits<double>::quiet_NaN();
  }
  SECTION("an odometry origin out of range") {
    m.T_odom_first.translation().x() = 1e9;
  }
  CHECK(refusal_of(m) != std::string());
}

TEST_CASE("An inconsistent session is refused", "[pose_graph]") {
  Session m = some_session();
  SECTION("no members") {
    m.plan.members.clear();
    m.plan.pairs.clear();
  }
  SECTION("a duplicate member") {
    m.plan.members[2].peer.robot = 2;
  }
  SECTION("a parent that is not a member") {
    m.plan.members[0].parent = RobotId{8};
  }
  SECTION("a member that is its own parent") {
    m.plan.members[1].parent = RobotId{2};
  }
  SECTION("a cycle of parents") {
    m.plan.members[1].parent = RobotId{60000};
  }
  SECTION("a pair with a robot that is not a member") {
    m.plan.pairs[2].b = 60001;
  }
  SECTION("a pair in the wrong order") {
    std::swap(m.plan.pairs[0].a, m.plan.pairs[0].b);
  }
  SECTION("pairs out of order") {
    std::swap(m.plan.pairs[0], m.plan.pairs[1]);
  }
  SECTION("a method that is not known") {
    m.method = static_cast<PgoMethod>(200);
  }
  SECTION("a cost that is not finite") {
    m.cost = std::numeric_limits<double>::infinity();
  }
  SECTION("an invalid gradient") {
    m.gradient = std::numeric_limits<double>::quiet_NaN();
  }
  CHECK(refusal_of(m) != std::string());
}

TEST_CASE("Invalid poses of a member are refused", "[pose_graph]") {
  MemberPoses m = some_poses();
  SECTION("keyframes out of order") {
    std::swap(m.keyframes[1], m.keyframes[2]);
  }
  SECTION("keyframe 0 is missing") {
    m.keyframes[0] = 1, m.keyframes[1] = 2;
  }
  SECTION("fewer poses than keyframes") {
    m.T_frame_kf.pop_back();
  }
  SECTION("more poses than keyframes") {
    m.T_frame_kf.push_back(m.T_frame_kf[0]);
  }
  SECTION("not finite") {
    m.T_frame_kf[3].t.z() = std::numeric_limits<float>::infinity();
  }
  SECTION("an invalid rotation") {
    m.T_frame_kf[3].q.coeffs() *= 1.01F;
  }
  SECTION("zero weight") {
    m.step_precision.tau = 0.0;
  }
  SECTION("too much weight") {
    m.step_precision.kappa = 1e300;
  }
  SECTION("a closure of a keyframe with itself") {
    m.verdicts[0].id.from = m.verdicts[0].id.to;
  }
  SECTION("a closure in the wrong order") {
    std::swap(m.verdicts[0].id.from, m.verdicts[0].id.to);
  }
  CHECK(refusal_of(m) != std::string());
}

TEST_CASE("Corrupted bytes give a message or a reason", "[pose_graph]") {
  const auto seed = GENERATE(1U, 2U, 3U, 4U);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const std::vector<TeamMessage> originals = one_of_each();
  std::size_t taken = 0;
  for (int run = 0; run < 30000; ++run) {
    const TeamMessage& original = originals[random() % originals.size()];
    Bytes bytes = encode(original);
    const std::size_t changes = 1 + random() % 3;
    for (std::size_t k = 0; k < changes; ++k) {
      const std::size_t place = random() % bytes.size();
      const auto value = static_cast<std::uint8_t>(random());
      switch (random() % 3) {
        case 0:
          bytes[place] = value;
          break;
        case 1:
          bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(place), value);
          break;
        default:
          bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(place));
      }
    }
    const auto result = decoded_as(original, bytes);
    if (result.value.has_value() == (result.refusal != nullptr)) FAIL("neither or both");
    // An accepted message can be forwarded.
    if (result.value && !decoded_as(original, encode(*result.value)).value) FAIL("not stable");
    taken += result.value ? 1 : 0;
  }
  CHECK(taken > 1000);  // most of the changed bytes may have any value
}

TEST_CASE("a solver's message that is too large is reported once, with the way out",
          "[pose_graph]") {
  TeamNotices notices(1);
  notices.message(kMaxTeamMessageBytes);
  CHECK(notices.take().empty());
  notices.message(kMaxTeamMessageBytes + 1);
  const auto reported = notices.take();
  REQUIRE(reported.size() == 1);
  CHECK(reported.front().find("16.8 MB") != std::string::npos);
  CHECK(reported.front().find("pose_graph.method=rbcd") != std::string::npos);
  notices.message(kMaxTeamMessageBytes + 2);
  CHECK(notices.take().empty());
}

}  // namespace
}  // namespace km
