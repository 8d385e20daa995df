#include "modules/core/io/bytes.hpp"
#include "modules/session/team_message_bytes.hpp"
#include "modules/session/team_notices.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr TeamPeer kPeer2{2, 0x1122334455667788};
constexpr TeamPeer kPeer7{7, 0x8877665544332211};
constexpr TeamPeer kPeer60000{60000, 1};

// A pose that a quaternion in double precision represents exactly.
SE3 exact_pose() {
  Eigen::Matrix3d R;
  R << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
  return make_pose(R, {1.25, -2.5, 1.0 / 3.0});
}

TeamStatus some_status() {
  return {
      .sender = kPeer7,
      .keyframes = 1000,
      .revision = 1007,
      .offers = {{2, 12, {3, 0xABCDEF0123456789}, 3}, {2, 9, {2, 5}, 1, true}, {60000, 1, {1, 77}}},
      .method = PgoMethod::kRbcd,
      .T_odom_first = exact_pose(),
      .upright = true,
      .datum = 77};
}

Session some_session() {
  return {.id = {kPeer2, 9},
          .plan = {.frame = {kPeer7, 6},
                   .members = {{kPeer7, 1007, RobotId{2}, 77},
                               {kPeer2, 4, {}},
                               {kPeer60000, 9, RobotId{7}}},
                   .pairs = {{2, 7, {3, 5}}, {2, 60000, {1, 6}}, {7, 60000, {2, 7}}}},
          .method = PgoMethod::kNewton,
          .upright = true,
          .max_rounds = 50,
          .anchor = 7,
          .T_frame_world = exact_pose(),
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
                    .frame = {kPeer2, 8},
                    .step_precision = {123.456, 7.0},
                    .odometry_precision = {0.5, 1.0},
                    .closure_precision = {0.25, 1.0},
                    .keyframes = {0, 1, 5, 200, 4'000'000'000U},
                    .later_runs = {5, 4'000'000'000U}};
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

// Checks that a message is refused after any of these changes.
template <typename T>
void check_refused(const T& message, const std::map<std::string, std::function<void(T&)>>& faults) {
  for (const auto& [fault, change] : faults) {
    CAPTURE(fault);
    T changed = message;
    change(changed);
    const auto result = decoded_as(changed, encode(changed));
    CHECK_FALSE(result.value);
    CHECK(result.refusal != nullptr);
  }
}

// Every field of these messages has a value of its own. Equal bytes after decoding and encoding
// therefore mean that decoding restores every field.
TEST_CASE("Decoding restores an encoded message") {
  for (const TeamMessage& message : one_of_each()) {
    CAPTURE(message.index());
    const Bytes bytes = encode(message);
    const auto again = decoded_as(message, bytes);
    REQUIRE(again.value);
    CHECK(again.value->index() == message.index());
    CHECK(origin_of(*again.value) == origin_of(message));
    CHECK(encode(*again.value) == bytes);
  }
  CHECK(round_trip(some_reliable_message()).to == some_reliable_message().to);
}

TEST_CASE("Messages without optional content are valid") {
  CHECK(round_trip(TeamStatus{.sender = kPeer2}).offers.empty());
  Session session = some_session();
  session.T_frame_world.reset();
  CHECK_FALSE(round_trip(session).T_frame_world);
  ReliableMessage reliable = some_reliable_message();
  reliable.bytes = nullptr;
  CHECK(round_trip(reliable).bytes->empty());
}

TEST_CASE("A pose of a member takes 29 bytes") {
  MemberPoses many = some_poses();
  many.keyframes.clear();
  many.verdicts.clear();
  for (KeyframeIndex k = 0; k < 1000; ++k) many.keyframes.push_back(3 * k);
  many.T_frame_kf.assign(1000, many.T_frame_kf[0]);
  CHECK(encode(many).size() < 29 * 1000 + 96);
}

TEST_CASE("No truncated message is accepted") {
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

TEST_CASE("Impossible counts are refused before memory is allocated") {
  ByteWriter count;
  count.varint(GENERATE(std::uint64_t{1} << 61U, std::numeric_limits<std::uint64_t>::max()));
  const Bytes huge = count.release();
  for (const TeamMessage& message :
       {TeamMessage(some_status()), TeamMessage(some_session()), TeamMessage(some_poses())}) {
    const Bytes bytes = encode(message);
    for (std::size_t k = 0; k < bytes.size(); ++k) {  // also in place of each count
      Bytes changed = bytes;
      changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(k));
      changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(k), huge.begin(), huge.end());
      CHECK_FALSE(decoded_as(message, changed).value);
    }
  }
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST_CASE("An inconsistent status is refused") {
  using S = TeamStatus;
  check_refused<S>(
      some_status(),
      {{"offers out of order", [](S& m) { std::swap(m.offers[0], m.offers[2]); }},
       {"an offer to itself", [](S& m) { m.offers[0].peer = m.sender.robot; }},
       {"an offer without edges", [](S& m) { m.offers[0].edges = 0; }},
       {"an unknown method", [](S& m) { m.method = static_cast<PgoMethod>(200); }},
       {"an odometry origin that is not finite",
        [](S& m) { m.T_odom_first.translation().x() = kNaN; }},
       {"an odometry origin out of range", [](S& m) { m.T_odom_first.translation().x() = 1e9; }}});
}

TEST_CASE("An inconsistent session is refused") {
  using S = Session;
  check_refused<S>(
      some_session(),
      {{"no members",
        [](S& m) {
          m.plan.members.clear();
          m.plan.pairs.clear();
        }},
       {"a duplicate member", [](S& m) { m.plan.members[2].peer.robot = 2; }},
       {"a parent that is no member", [](S& m) { m.plan.members[0].parent = RobotId{8}; }},
       {"a member that is its own parent", [](S& m) { m.plan.members[1].parent = RobotId{2}; }},
       {"two roots", [](S& m) { m.plan.members[0].parent.reset(); }},
       {"another coordinator than the lowest member", [](S& m) { m.id.coordinator = kPeer7; }},
       {"a cycle of parents", [](S& m) { m.plan.members[1].parent = RobotId{60000}; }},
       {"a pair with a robot that is no member", [](S& m) { m.plan.pairs[2].b = 60001; }},
       {"a pair in the wrong order", [](S& m) { std::swap(m.plan.pairs[0].a, m.plan.pairs[0].b); }},
       {"pairs out of order", [](S& m) { std::swap(m.plan.pairs[0], m.plan.pairs[1]); }},
       {"an unknown method", [](S& m) { m.method = static_cast<PgoMethod>(200); }},
       {"a cost that is not finite", [](S& m) { m.cost = kInfinity; }},
       {"an invalid gradient", [](S& m) { m.gradient = kNaN; }}});
}

TEST_CASE("Invalid poses of a member are refused") {
  using P = MemberPoses;
  check_refused<P>(
      some_poses(),
      {{"keyframes out of order", [](P& m) { std::swap(m.keyframes[1], m.keyframes[2]); }},
       {"no keyframes", [](P& m) { m.keyframes.clear(), m.T_frame_kf.clear(); }},
       {"keyframe 0 is missing", [](P& m) { m.keyframes[0] = 1, m.keyframes[1] = 2; }},
       {"runs out of order", [](P& m) { std::swap(m.later_runs[0], m.later_runs[1]); }},
       {"fewer poses than keyframes", [](P& m) { m.T_frame_kf.pop_back(); }},
       {"more poses than keyframes", [](P& m) { m.T_frame_kf.push_back(m.T_frame_kf[0]); }},
       {"not finite", [](P& m) { m.T_frame_kf[3].t.z() = static_cast<float>(kInfinity); }},
       {"an invalid rotation", [](P& m) { m.T_frame_kf[3].q.coeffs() *= 1.01F; }},
       {"zero weight", [](P& m) { m.step_precision.tau = 0.0; }},
       {"odometry better than claimed", [](P& m) { m.odometry_precision.kappa = 2.0; }},
       {"closures without weight", [](P& m) { m.closure_precision.kappa = 0.0; }},
       {"closures better than claimed", [](P& m) { m.closure_precision.tau = 2.0; }},
       {"too much weight", [](P& m) { m.step_precision.kappa = 1e300; }},
       {"a closure of a keyframe with itself",
        [](P& m) { m.verdicts[0].id.from = m.verdicts[0].id.to; }},
       {"a closure in the wrong order",
        [](P& m) { std::swap(m.verdicts[0].id.from, m.verdicts[0].id.to); }}});
}

TEST_CASE("a solver's message that is too large is reported once, with the way out") {
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
