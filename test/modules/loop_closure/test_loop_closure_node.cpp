#include "modules/loop_closure/keyframe_features.hpp"
#include "test/modules/loop_closure/loop_closure_robots.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("a candidate becomes a closure by one request and one reply") {
  Meeting meeting(1);
  auto& [scene, robot, peer] = meeting;
  robot.give(scene.candidate());
  REQUIRE(robot.requests.size() == 1);
  CHECK(robot.requests[0].to == kPeer);
  CHECK(robot.requests[0].message->keyframe == scene.peer.odometry.id);
  deliver(robot, peer);

  REQUIRE(robot.closures.size() == 1);
  const Closure& closure = robot.closures[0];
  CHECK(closure.id() == ClosureId{scene.own.odometry.id, scene.peer.odometry.id});
  CHECK(closure.similarity == 1.5);
  CHECK(closure.inliers > 100);
  CHECK(closure.to.T_odom_kf.isApprox(scene.peer.odometry.T_odom_kf));
  CHECK(closure.from.covariance == scene.own.odometry.covariance);
  CHECK(se3_log(closure.T_from_to.inverse() * scene.T_own_peer).norm() < 0.03);  // [m], [rad]
  CHECK(stages_of(robot.reports) == Stages{kCandidate, kRequested, kVerified});
  CHECK(robot.reports.back().inliers == closure.inliers);
}

TEST_CASE("a candidate that waits is not requested near a closure that was verified meanwhile") {
  const int separation = GENERATE(0, 64);
  const Scene scene(30);
  Robot robot(
      kSelf,
      {.max_closure_separation = separation, .max_request_separation = 0, .min_word_points = 0});
  Robot peer(kPeer);
  robot.give(scene.own);
  peer.give(scene.peer);
  Keyframe next = scene.peer;
  next.odometry.id.index = 6;
  peer.give(next);
  for (KeyframeIndex lost = 1000; lost < 1007; ++lost)  // all but one of the requests at a time
    robot.give(LoopCandidate{{kPeer, lost}, scene.own.odometry.id, 1.5});
  robot.requests.clear();
  robot.give(scene.candidate());
  robot.give(LoopCandidate{next.odometry.id, scene.own.odometry.id, 1.5});
  REQUIRE(robot.requests.size() == 1);
  deliver(robot, peer);
  for (const double now_s : {0.1, 0.2, 5.0}) {
    robot.tick(now_s);
    deliver(robot, peer);
  }
  REQUIRE_FALSE(robot.reports.empty());
  if (separation == 0) {
    CHECK(robot.closures.size() == 2);
  } else {
    CHECK(robot.closures.size() == 1);
    CHECK(robot.reports.back().id.to == next.odometry.id);
    CHECK(robot.reports.back().stage == kCandidate);
    CHECK(robot.reports.back().reason == "not requested: near a verified closure");
  }
}

TEST_CASE("a candidate seen twice is verified once, and a keyframe fetched once") {
  Meeting meeting(2);
  auto& [scene, robot, peer] = meeting;
  robot.give(scene.candidate());
  robot.give(scene.candidate());
  deliver(robot, peer);
  robot.give(scene.candidate());
  CHECK(robot.closures.size() == 1);

  Keyframe second = scene.own;  // another own keyframe against the same one of the peer
  second.odometry.id.index = 1;
  robot.give(second);
  robot.give(LoopCandidate{scene.peer.odometry.id, second.odometry.id, 1.4});
  CHECK(robot.requests.empty());
  CHECK(robot.closures.size() == 2);
}

TEST_CASE("a robot compares no pair that its peer compares or has verified") {
  Meeting meeting(24);
  auto& [scene, robot, peer] = meeting;
  SECTION("compares") {
    robot.give(KeyframeRequest{.requester = kPeer, .number = 1, .keyframe = {kSelf, 0}, .own = 5});
    robot.give(scene.candidate());
    REQUIRE_FALSE(robot.reports.empty());
    CHECK(robot.reports.back().reason == "not requested: near a requested candidate");
  }
  SECTION("has verified") {
    Closure closure{.from = scene.peer.odometry, .to = scene.own.odometry, .T_from_to = {}};
    closure.T_from_to.setIdentity();
    closure.from.id.index = 6;
    robot.give(closure);
    robot.give(scene.candidate());
    REQUIRE_FALSE(robot.reports.empty());
    CHECK(robot.reports.back().reason == "not requested: near a verified closure");
  }
  CHECK(robot.requests.empty());
}

PeerEvent event_of(PeerEventKind kind) {
  PeerEvent event{kind, {}, {}};
  event.identity.robot = kPeer;
  return event;
}

TEST_CASE("work with a restarted peer begins again and with a resumed one continues") {
  Meeting meeting(5);
  auto& [scene, robot, peer] = meeting;
  std::vector<PeerEventKind> restarts;
  robot.own_restarts.subscribe([&](const auto& event) { restarts.push_back(event->kind); });
  robot.give(scene.candidate());
  deliver(robot, peer);
  REQUIRE(robot.closures.size() == 1);
  SECTION("restarted") {
    robot.give(event_of(PeerEventKind::kRestarted));
    CHECK(restarts == std::vector{PeerEventKind::kRestarted});
    robot.give(scene.candidate());
    CHECK(robot.requests.size() == 1);  // its keyframe is another
    deliver(robot, peer);
    CHECK(robot.closures.size() == 2);
  }
  SECTION("resumed") {
    robot.give(event_of(PeerEventKind::kResumed));
    CHECK(restarts.empty());
    robot.give(scene.candidate());
    CHECK(robot.requests.empty());
    CHECK(robot.closures.size() == 1);
  }
}

TEST_CASE("work for a peer is dropped when it restarts and requested again when it comes back") {
  const bool measured = GENERATE(true, false);
  const bool own_is_missing = GENERATE(true, false);
  CAPTURE(measured, own_is_missing);
  const Scene scene(5);
  Robot robot(kSelf), peer(kPeer);
  peer.give(scene.peer);
  if (!own_is_missing) robot.give(scene.own);
  if (measured)
    robot.give(RelativePose{.from = scene.own.odometry.id, .to = scene.peer.odometry.id});
  else
    robot.give(scene.candidate());
  for (int t = 0; t < 60; ++t) robot.tick(t);  // no peer replies
  robot.requests.clear();
  SECTION("restarted") {
    robot.give(event_of(PeerEventKind::kRestarted));
    robot.give(scene.own);
    for (int t = 60; t < 120; ++t) robot.tick(t);
    CHECK(robot.requests.empty());
    robot.give(KeyframeReply{.number = 0, .found = true, .keyframe = scene.peer});  // late
    CHECK(robot.closures.empty());
  }
  SECTION("resumed or returned") {
    robot.give(event_of(PeerEventKind::kLost));
    CHECK(robot.requests.empty());
    robot.give(event_of(GENERATE(PeerEventKind::kResumed, PeerEventKind::kReturned)));
    CHECK(robot.requests.size() == (own_is_missing ? 0 : 1));
    robot.give(scene.own);
    robot.tick(60);
    deliver(robot, peer);
    CHECK(robot.closures.size() == 1);
  }
}

// Keyframes 0 and 50 of the robot itself see the same place.
Scene scene_of_one_robot() {
  Scene scene(8);
  scene.peer.odometry.id = {kSelf, 50};
  return scene;
}

LoopClosureConfig with_full_keyframes(int count) {
  LoopClosureConfig config{.reply_keypoints = 50, .full_keyframes = count};
  return config;
}

TEST_CASE("candidates inside one robot need no request, in whatever order things arrive") {
  const Scene scene = scene_of_one_robot();
  Robot robot(kSelf);
  const bool candidate_first = GENERATE(false, true);
  CAPTURE(candidate_first);
  if (candidate_first) robot.give(scene.candidate());
  robot.give(scene.own);
  robot.give(scene.peer);
  if (!candidate_first) robot.give(scene.candidate());
  CHECK(robot.requests.empty());
  REQUIRE(robot.closures.size() == 1);
  CHECK(robot.closures[0].id() == ClosureId{{kSelf, 0}, {kSelf, 50}});
  robot.give(LoopCandidate{scene.own.odometry.id, scene.peer.odometry.id, 0.7});
  CHECK(robot.closures.size() == 1);  // the same pair from the other side
}

TEST_CASE("inside one robot keyframes are matched by ORB alone") {
  Scene scene = scene_of_one_robot();
  describe(scene, 7, 7);
  const bool has_orb = GENERATE(true, false);
  for (BinaryDescriptor& descriptor : scene.peer.features.descriptors)
    if (!has_orb) descriptor = {};
  Robot robot(kSelf);
  robot.give(scene.own);
  robot.give(scene.peer);
  robot.give(scene.candidate());
  CHECK(robot.closures.size() == (has_orb ? 1 : 0));
}

TEST_CASE("a closure inside a robot must be more certain than one between robots") {
  Scene inside = scene_of_one_robot();
  const auto sigma_rad = [&] {
    return Verifier({}).verify(inside.own.features, inside.peer.features).rotation_sigma_rad;
  };
  // Few points, in ever coarser images, determine the pose less.
  for (KeyframeFeatures* features : {&inside.own.features, &inside.peer.features})
    *features = reduced(*features, 20);
  while (sigma_rad() <= LoopClosureNode::kMaxOwnRotationSigma_rad) {
    REQUIRE(inside.own.features.focal_px > 50.0);
    for (KeyframeFeatures* features : {&inside.own.features, &inside.peer.features})
      features->focal_px *= 0.9;
  }
  REQUIRE(sigma_rad() < LoopClosureConfig().max_rotation_sigma_rad);
  Robot robot(kSelf);
  robot.give(inside.own);
  robot.give(inside.peer);
  robot.give(inside.candidate());
  CHECK(robot.closures.empty());
  CHECK_THAT(robot.reports.back().reason, Contains("depends on a few inliers"));

  Scene between = inside;
  between.peer.odometry.id = {kPeer, 5};
  Meeting meeting(between);
  meeting.robot.give(between.candidate());
  deliver(meeting.robot, meeting.peer);
  CHECK(meeting.robot.closures.size() == 1);
}

TEST_CASE("an old keyframe of the robot itself keeps a part of its keypoints") {
  const Scene scene = scene_of_one_robot();
  const int full = GENERATE(50, 51);
  CAPTURE(full);
  Robot robot(kSelf, with_full_keyframes(full));
  robot.give(scene.own);
  robot.give(scene.peer);
  robot.give(scene.candidate());
  REQUIRE(robot.closures.size() == 1);
  if (full == 50)  // keyframe 0 is the 51st
    CHECK(robot.closures[0].inliers <= 100);
  else
    CHECK(robot.closures[0].inliers > 100);
}

TEST_CASE("an old keyframe of the robot itself is read from the disk with all its keypoints") {
  const Scene scene = scene_of_one_robot();
  bool is_there = true;
  int read_keyframeed = 0;
  const auto read_keyframe = [&](KeyframeIndex index) -> std::shared_ptr<const Keyframe> {
    CHECK(index == 0);
    ++read_keyframeed;
    return is_there ? std::make_shared<const Keyframe>(scene.own) : nullptr;
  };
  Robot robot(kSelf, with_full_keyframes(50), read_keyframe);
  const bool is_full = GENERATE(false, true);
  is_there = !is_full;
  robot.give(scene.own);
  CHECK(read_keyframeed == 0);
  robot.give(scene.peer);
  CHECK(read_keyframeed == 1);
  SECTION("or stays in part where the disk has not taken it") {
    robot.give(scene.candidate());
    REQUIRE(robot.closures.size() == 1);
    CHECK((robot.closures[0].inliers > 100) == !is_full);
    CHECK(read_keyframeed == (is_full ? 1 : 2));
  }
  SECTION("and is missed once the disk is gone") {
    is_there = false;
    robot.give(scene.candidate());
    robot.give(KeyframeRequest{kPeer, 1, {kSelf, 0}, 3});
    REQUIRE(robot.replies.size() == 1);
    CHECK(robot.replies[0].message->found == is_full);
    CHECK(robot.closures.size() == (is_full ? 1 : 0));
    if (!is_full) CHECK(robot.reports.back().reason == "cannot be read from the disk any more");
  }
}

TEST_CASE("a measured closure needs only the odometry of the other end") {
  Scene views(9);
  views.own.features = views.peer.features = {};
  Meeting meeting(views);
  auto& [scene, robot, peer] = meeting;
  std::mt19937 rng(1);
  const RelativePose measured{scene.own.odometry.id, scene.peer.odometry.id, random_pose(rng),
                              random_covariance(rng, 0.1)};
  robot.give(measured);
  deliver(robot, peer);
  REQUIRE(robot.closures.size() == 1);
  CHECK(robot.closures[0].T_from_to.matrix() == measured.T_from_to.matrix());
  CHECK(robot.closures[0].covariance == measured.covariance);
  CHECK(robot.closures[0].to.T_odom_kf.isApprox(scene.peer.odometry.T_odom_kf));
}

TEST_CASE("closures that start at another robot and misdirected requests are ignored") {
  const Scene scene(10);
  Robot robot(kSelf);
  robot.give(scene.own);
  robot.give(LoopCandidate{{kSelf, 0}, {kPeer, 5}, 0.9});
  robot.give(RelativePose{{kPeer, 5}, {kSelf, 0}, SE3::Identity(), Matrix6::Identity()});
  robot.give(KeyframeRequest{kPeer, 1, {77, 0}});
  CHECK(robot.requests.empty());
  CHECK(robot.replies.empty());
  CHECK(robot.reports.empty());
}

}  // namespace
}  // namespace km
