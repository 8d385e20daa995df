#include "modules/core/geometry/lie.hpp"
#include "modules/view/view_selector.hpp"
#include "test/modules/view/watcher.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kSelf = 3;

// Rounding of float32 poses at 100 m.
constexpr double kRounding_m = 2e-5;
constexpr double kRounding_rad = 1e-6;

// Content after encoding and decoding.
void receive(const ViewContent& content, Watcher& watcher) {
  const auto bytes = encode_view(content);
  CHECK(bytes.size() < ViewSelector::kUpdateBytes + 100);
  const auto decoded = decode_view(bytes);
  REQUIRE(decoded);
  watcher.receive(*decoded);
}

void receive_all(ViewSelector& selector, Watcher& watcher, double now_s) {
  while (const auto content = selector.next(now_s)) receive(*content, watcher);
}

KeyframeOdometry keyframe(KeyframeIndex index, const SE3& T) {
  KeyframeOdometry result;
  result.id = {kSelf, index};
  result.T_odom_kf = T;
  return result;
}

// Selector of a robot whose trajectories are stated as changes.
struct Selector : ViewSelector {
  Selector() : ViewSelector(kSelf) {}
  void set_trajectory(const std::vector<SE3>& poses, RobotId anchor = kSelf) {
    if (const auto changes = stated.update(Trajectory{kSelf, anchor, poses})) add(*changes);
  }
  StatedPoses stated;
};

void check_within_bounds(const Watcher& watcher, const std::vector<SE3>& truth, RobotId anchor) {
  REQUIRE(watcher.optimized.size() == truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) {
    CAPTURE(k);
    const auto& known = watcher.optimized.at(static_cast<KeyframeIndex>(k));
    CHECK(known.anchor == anchor);
    CHECK((known.T.translation() - truth[k].translation()).norm() <=
          StatedPoses::kMaxShift_m + kRounding_m);
    CHECK(angle_of(known.T.linear().transpose() * truth[k].linear()) <=
          StatedPoses::kMaxTurn_rad + kRounding_rad);
  }
}

ClosureId pair_of(KeyframeIndex own, KeyframeIndex other) {
  return closure_id({kSelf, own}, {7, other});
}

ClosureOutcome outcome(const ClosureId& id, ClosureStage stage, const char* reason = "") {
  return {id, 0.5, stage, reason, 40, 20};
}

Closure closure(const ClosureId& id, int inliers) {
  Closure result;
  result.from.id = id.from;
  result.to.id = id.to;
  result.inliers = inliers;
  return result;
}

}  // namespace

TEST_CASE("The newest pose is sent a few times a second") {
  ViewSelector selector(kSelf);
  Watcher watcher;
  Stamp last = 0;
  for (int tick = 0; tick < 200; ++tick) {  // 20 images a second for 10 s.
    OdometryState state;
    state.stamp = last = 1000 + tick;
    selector.add(state);
    receive_all(selector, watcher, 0.05 * tick);
  }
  CHECK(watcher.poses.size() == 25);
  receive_all(selector, watcher, 11.0);
  CHECK(watcher.poses.back().stamp == last);
  receive_all(selector, watcher, 12.0);
  CHECK(watcher.poses.size() == 26);  // Each sent once.
}

// A graph that changes faster than it can be sent: one update per round.
TEST_CASE("Sent poses are within the bound in the end") {
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  Selector selector;
  Watcher watcher, late;
  std::vector<SE3> poses;
  std::normal_distribution<double> step(0.0, 0.005);
  for (int round = 0; round < 300; ++round) {
    poses.push_back(random_pose(rng, 100.0));
    for (SE3& T : poses) {
      T.translation() += Eigen::Vector3d(step(rng), step(rng), step(rng));
      T.linear() = T.linear() * so3_exp({step(rng), 0.0, 0.0});
    }
    selector.add(keyframe(static_cast<KeyframeIndex>(round), poses.back()));
    selector.set_trajectory(poses, round < 150 ? kSelf : RobotId{1});
    const auto content = selector.next(round);
    if (content) receive(*content, watcher);
  }
  receive_all(selector, watcher, 300.0);
  check_within_bounds(watcher, poses, 1);
  CHECK(watcher.odometry.size() == 300);
  CHECK_FALSE(selector.sends_past());

  selector.begin_again();
  CHECK(selector.sends_past());
  receive_all(selector, late, 300.0);
  CHECK_FALSE(selector.sends_past());
  check_within_bounds(late, poses, 1);
  CHECK(late.odometry.size() == 300);
}

TEST_CASE("The stage of a pair of keyframes is sent when it changes") {
  ViewSelector selector(kSelf);
  Watcher watcher;
  const ClosureId id = pair_of(10, 20);
  const auto verdict = [&] {
    receive_all(selector, watcher, 0.0);
    return watcher.closures.at(id).verdict;
  };
  selector.add(outcome(id, ClosureStage::kCandidate));
  CHECK(verdict() == ClosureStatus::kCandidate);
  selector.add(outcome(id, ClosureStage::kRequested));
  CHECK(verdict() == ClosureStatus::kCandidate);
  CHECK(watcher.order.size() == 1);  // No second update without a change.
  SECTION("verification stops") {
    selector.add(outcome(id, ClosureStage::kReceived, "too few matches"));
    CHECK(verdict() == ClosureStatus::kRejected);
    CHECK(watcher.closures.at(id).reason == "too few matches");
    CHECK(watcher.closures.at(id).matches == 40);
    selector.add(closure(id, 33));  // The other robot has verified it.
    CHECK(verdict() == ClosureStatus::kVerified);
    CHECK(watcher.closures.at(id).reason.empty());
    CHECK(watcher.closures.at(id).inliers == 33);
  }
  SECTION("verified, kept, and overruled") {
    selector.add(outcome(id, ClosureStage::kVerified));
    CHECK(verdict() == ClosureStatus::kVerified);
    selector.add(ClosureJudgements{{{id, true, false}, {pair_of(11, 21), true, false}}});
    CHECK(verdict() == ClosureStatus::kKept);
    CHECK(watcher.closures.size() == 1);
    selector.add(ClosureJudgements{{{id, true, true}}});
    CHECK(verdict() == ClosureStatus::kRejected);
    CHECK(watcher.closures.at(id).reason == "the other closures contradict it");
    selector.add(ClosureJudgements{{{id, true, false}}});
    CHECK(verdict() == ClosureStatus::kKept);
    selector.add(ClosureJudgements{{{id, false, false}}});
    CHECK(verdict() == ClosureStatus::kVerified);
    selector.restarted(8);
    CHECK(verdict() == ClosureStatus::kVerified);
    selector.restarted(7);
    CHECK(verdict() == ClosureStatus::kRejected);
    CHECK(watcher.closures.at(id).reason == "its robot was restarted");
  }
  SECTION("a judgement that arrives before its closure") {
    selector.add(ClosureJudgements{{{pair_of(12, 22), true, false}}});
    selector.add(closure(pair_of(12, 22), 50));
    receive_all(selector, watcher, 0.0);
    CHECK(watcher.closures.at(pair_of(12, 22)).verdict == ClosureStatus::kKept);
  }
  SECTION("no closures between other robots") {
    selector.add(closure(closure_id({1, 1}, {2, 2}), 50));
    receive_all(selector, watcher, 0.0);
    CHECK(watcher.closures.size() == 1);
  }
  SECTION("the present stage to a late viewer") {
    selector.add(outcome(id, ClosureStage::kVerified));
    receive_all(selector, watcher, 0.0);
    Watcher late;
    selector.begin_again();
    receive_all(selector, late, 0.0);
    REQUIRE(late.closures.size() == 1);
    CHECK(late.closures.at(id).verdict == ClosureStatus::kVerified);
  }
}

TEST_CASE("Verified closures are sent before all other updates") {
  ViewSelector selector(kSelf);
  for (KeyframeIndex k = 0; k < 500; ++k) {
    selector.add(keyframe(k, SE3::Identity()));
    selector.add(outcome(pair_of(k, 1), ClosureStage::kCandidate));
  }
  selector.add(OdometryState{});
  selector.add(outcome(pair_of(300, 1), ClosureStage::kVerified));
  Watcher watcher;
  receive(*selector.next(0.0), watcher);
  REQUIRE(watcher.order.size() == 1);
  CHECK(watcher.order[0] == pair_of(300, 1));
  receive(*selector.next(0.0), watcher);
  CHECK(watcher.poses.size() == 1);
  receive(*selector.next(0.0), watcher);
  CHECK(watcher.odometry_received > 10);
  receive_all(selector, watcher, 0.0);
  CHECK(watcher.closures.size() == 500);
  CHECK(watcher.order.size() == 500);        // Each sent once.
  CHECK(watcher.order[1] == pair_of(0, 1));  // In the order in which they were found.
}

}  // namespace km
