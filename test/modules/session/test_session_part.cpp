#include "modules/core/io/bytes.hpp"
#include "modules/session/session_part.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr TeamPeer kSelf{1, 1};
constexpr TeamPeer kOther{2, 1};

// A solver that takes messages with one number each, in order. It refuses messages that arrive too
// early or contain no number.
class OrderlySolver final : public MemberSolver {
 public:
  explicit OrderlySolver(std::uint32_t& taken) : taken_(taken) {}

  bool receive(RobotId, std::span<const std::uint8_t> bytes) override {
    ByteReader in(bytes);
    const std::uint32_t number = in.u32();
    if (!in.done() || number > taken_) return false;
    if (number == taken_) ++taken_;
    return true;
  }
  [[nodiscard]] bool ready() const override { return false; }
  [[nodiscard]] std::vector<SolverMessage> advance() override { return {}; }
  [[nodiscard]] bool done() const override { return false; }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return poses_; }
  [[nodiscard]] SolverState state() const override { return {}; }
  [[nodiscard]] ClosureVerdicts verdicts() const override { return {}; }

 private:
  std::uint32_t& taken_;
  std::vector<SE3> poses_{SE3::Identity()};
};

// The part of one robot in a session with another robot, whose messages it receives.
struct Correspondence {
  std::uint32_t taken = 0;  // number of messages that the solver has taken
  Session session{.id = {kSelf, 1},
                  .plan = {.frame = {kSelf, 1},
                           .members = {{.peer = kSelf}, {.peer = kOther, .parent = kSelf.robot}},
                           .pairs = {}}};
  SessionPart part{session,
                   kSelf,
                   {.graph = {.self = kSelf.robot, .start = {SE3::Identity()}},
                    .place = {.children = {2}, .members = {1, 2}, .root = 1},
                    .in_frame = true,
                    .public_keyframes = {0}},
                   [this](const Session&, SessionGraph, const TreePlace&) {
                     return std::make_unique<OrderlySolver>(taken);
                   },
                   0.0};
  ReliableChannel others{kOther, session.id, 1.0};
  PublicPoses published = {};

  Correspondence() {
    (void)part.advance(published, 0.0);
    REQUIRE(part.stage() == MemberStage::kEntered);
  }
  // Lets the solver begin; the senders of early messages that it refuses.
  std::vector<RobotId> begin(double now_s) {
    published[kOther.robot] = {.sender = kOther, .session = session.id, .keyframes = {0}};
    published[kOther.robot].T_frame_kf.resize(1);
    const SessionWork work = part.advance(published, now_s);
    REQUIRE(work.any);
    return work.refused;
  }
  ReliableMessage write(const std::vector<std::uint8_t>& bytes, double now_s = 0.0) {
    return others.write({kSelf.robot, std::make_shared<const std::vector<std::uint8_t>>(bytes)},
                        now_s);
  }
  ReliableMessage write_number(std::uint32_t number) {
    ByteWriter out;
    out.u32(number);
    return write(out.release());
  }
  void exchange(double from_s, double to_s) {
    for (double now_s = from_s; now_s < to_s; now_s += 0.1) {
      for (const ReliableMessage& message : others.due(now_s)) (void)part.receive(message, now_s);
      for (const ReliableMessage& message : part.advance(published, now_s).messages)
        (void)others.read(message, now_s);
    }
  }
};

}  // namespace

TEST_CASE("a message that the solver cannot take yet is repeated") {
  Correspondence c;
  (void)c.begin(0.0);
  const ReliableMessage first = c.write_number(0), second = c.write_number(1);
  CHECK_FALSE(c.part.receive(second, 0.0));
  CHECK(c.part.receive(first, 0.0));
  CHECK(c.taken == 1);
  c.exchange(0.1, 20.0);
  CHECK(c.taken == 2);
  CHECK(c.others.due(1000.0).empty());
}

TEST_CASE("messages before the solver begins are not lost, in any number and order") {
  constexpr std::uint32_t kMessages = 1500;
  Correspondence c;
  std::vector<ReliableMessage> messages;
  for (std::uint32_t k = 0; k < kMessages; ++k) messages.push_back(c.write_number(k));
  std::shuffle(messages.begin(), messages.end(), std::mt19937(1));
  for (const ReliableMessage& message : messages) CHECK(c.part.receive(message, 0.0));
  (void)c.begin(0.1);
  c.exchange(0.2, 60.0);
  CHECK(c.taken == kMessages);
  CHECK(c.others.due(1000.0).empty());
}

TEST_CASE("a robot computes with the public poses that the other robots receive, to the last bit") {
  std::mt19937 rng(5);
  FrozenPart frozen{.graph = {.self = kSelf.robot},
                    .place = {.children = {2}, .members = {1, 2}, .root = 1},
                    .in_frame = true};
  for (KeyframeIndex k = 0; k < 200; ++k) {
    frozen.graph.start.push_back(random_pose(rng, 100.0));
    frozen.public_keyframes.push_back(k);
  }
  Session session = Correspondence().session;
  std::vector<SE3> start;
  SessionPart part(
      session, kSelf, frozen,
      [&](const Session&, const SessionGraph& graph, const TreePlace&) {
        start = graph.start;
        return std::unique_ptr<MemberSolver>();
      },
      0.0);
  (void)part.advance({}, 0.0);
  REQUIRE(part.stage() == MemberStage::kEntered);
  const std::vector<SinglePose> received = part.public_poses();
  PublicPoses published;
  published[kOther.robot] = {.sender = kOther, .session = session.id, .keyframes = {0}};
  published[kOther.robot].T_frame_kf.resize(1);
  (void)part.advance(published, 0.0);
  REQUIRE(received.size() == start.size());
  for (std::size_t k = 0; k < received.size(); ++k)
    CHECK(received[k].pose().matrix() == start[k].matrix());
}

TEST_CASE("refused messages do not keep a session alive") {
  Correspondence c;
  CHECK(c.part.receive(c.write({1, 2, 3}), 0.0));  // not detectable before the solver begins
  CHECK(c.begin(0.0) == std::vector<RobotId>{2});
  CHECK_FALSE(c.part.receive(c.write({1, 2, 3}), 5.0));
  ReliableMessage stranger = c.write_number(0);
  stranger.sender = {3, 1};
  CHECK_FALSE(c.part.receive(stranger, 5.0));
  stranger.sender = {kOther.robot, 2};
  CHECK_FALSE(c.part.receive(stranger, 5.0));
  ReliableMessage impossible = c.write_number(0);
  impossible.number = 1'000'000;
  CHECK_FALSE(c.part.receive(impossible, 5.0));
  impossible = c.write_number(0);
  impossible.received = 7;  // acknowledges messages that this robot has never sent
  CHECK_FALSE(c.part.receive(impossible, 5.0));
  CHECK(c.part.cost().last_activity_s == 0.0);
}

}  // namespace km
