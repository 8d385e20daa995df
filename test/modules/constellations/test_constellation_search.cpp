#include "modules/constellations/constellation_search.hpp"
#include "modules/constellations/node/constellations_node.hpp"
#include "modules/objects/map_object.hpp"
#include "test/modules/constellations/scenes.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/inbox.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// The message of a robot that drove through `scene` along x, in the direction `sign`. Keyframe k
// is at x = sign * (3 k - 30), heading along the motion. The frame `world` of the robot has the
// pose T_scene_world. The centres err by `sigma_m`, and the odometry is exact.
RobotObjects message_of(RobotId robot, const std::vector<TrueObject>& scene,
                        const SE3& T_scene_world, double sign, double sigma_m, std::mt19937& rng) {
  RobotObjects message{.robot = robot, .boot = 1, .anchor = robot, .objects = {}};
  const Eigen::Matrix3d heading =
      Eigen::AngleAxisd(sign > 0.0 ? 0.0 : std::numbers::pi, Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  const auto pose_of = [&](KeyframeIndex k) {
    return SE3(T_scene_world.inverse() * make_pose(heading, {sign * (3.0 * k - 30.0), 0.0, 0.0}));
  };
  for (const TrueObject& object : scene) {
    const double way_m = sign * object.center.x() + 30.0;
    const auto k = static_cast<KeyframeIndex>(std::clamp(way_m / 3.0, 0.0, 20.0));
    Eigen::Vector3d center = object.center;
    for (double& c : center) c += sigma_m * normal(rng);
    const SE3 T_world_box =
        T_scene_world.inverse() * make_pose(Eigen::Matrix3d::Identity(), center);
    message.objects.push_back({.label = object.label,
                               .keyframe = k,
                               .T_kf_box = pose_of(k).inverse() * T_world_box,
                               .T_world_kf = pose_of(k),
                               .size_m = object.size_m,
                               .surface_m2 = 1.0,
                               .views = 5});
  }
  for (const KeyframeIndex k : {0U, 8U, 18U})
    message.keyframes.push_back(
        {{.id = {robot, k}, .T_odom_kf = pose_of(0).inverse() * pose_of(k)}, pose_of(k)});
  return message;
}

constexpr RobotId kSelf = 1, kOther = 2;
constexpr double kNoise_m = 0.1;

// Two robots that drove through one scene in opposite directions.
struct Meeting {
  explicit Meeting(unsigned seed) : rng(seed) {
    const auto scene = square(24, rng);
    const SE3 T_scene_own = random_upright(rng), T_scene_peer = random_upright(rng);
    own = message_of(kSelf, scene, T_scene_own, 1.0, kNoise_m, rng);
    peer = message_of(kOther, scene, T_scene_peer, -1.0, kNoise_m, rng);
    T_own_peer = T_scene_own.inverse() * T_scene_peer;
  }
  std::mt19937 rng;
  RobotObjects own, peer;
  SE3 T_own_peer;  // between both frames `world`
};

std::vector<Closure> all_of(ConstellationSearch& search, double now_s = 100.0) {
  std::vector<Closure> closures;
  for (int n = 0; n < 100 && !search.is_done(); ++n)
    if (auto closure = search.step(now_s)) closures.push_back(*std::move(closure));
  return closures;
}

SE3 pose_in(const RobotObjects& message, const KeyframeId& id) {
  for (const SurfaceKeyframe& keyframe : message.keyframes)
    if (keyframe.odometry.id == id) return keyframe.T_world_kf;
  FAIL("no keyframe " << to_string(id));
  return SE3::Identity();
}

TEST_CASE("Robots that meet in opposite directions get one closure with the true relative pose") {
  const auto seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  const Meeting meeting(seed);
  ConstellationSearch search(kSelf);
  search.add(meeting.own, 0.0);
  search.add(meeting.peer, 0.0);
  const auto closures = all_of(search);
  REQUIRE(closures.size() == 1);
  const Closure& closure = closures[0];
  CHECK(closure.from.id.robot == kSelf);
  CHECK(closure.to.id.robot == kOther);
  CHECK(is_covariance(closure.covariance));
  const SE3 truth = pose_in(meeting.own, closure.from.id).inverse() * meeting.T_own_peer *
                    pose_in(meeting.peer, closure.to.id);
  const Vector6 error = se3_log(closure.T_from_to.inverse() * truth);
  CHECK(error.dot(closure.covariance.inverse() * error) < 30.0);
  CHECK(error.tail<3>().norm() < 1.0);
}

TEST_CASE("A closure nearby excludes another one, and one far away does not") {
  const Meeting meeting(3);
  ConstellationSearch search(kSelf);
  search.add(meeting.own, 0.0);
  search.add(meeting.peer, 0.0);
  Closure known{.from = meeting.peer.keyframes[1].odometry,
                .to = meeting.own.keyframes[1].odometry};
  std::size_t expected = 0;
  SECTION("nearby") {}
  SECTION("far away") {
    known.to.T_odom_kf.translation().x() += 500.0;
    known.to.id.index += 200;
    expected = 1;
  }
  search.add(known);
  CHECK(all_of(search).size() == expected);
}

TEST_CASE("Only the robot with the lower id searches, and no robot matches itself") {
  const Meeting meeting(4);
  ConstellationSearch higher(kOther);
  higher.add(meeting.own, 0.0);
  higher.add(meeting.peer, 0.0);
  CHECK(all_of(higher).empty());
  ConstellationSearch alone(kSelf);
  alone.add(meeting.own, 0.0);
  CHECK(all_of(alone).empty());
  CHECK(alone.is_done());
}

TEST_CASE("Objects that still change wait, and unchanged ones are matched once") {
  const Meeting meeting(5);
  ConstellationSearch search(kSelf);
  search.add(meeting.own, 0.0);
  search.add(meeting.peer, 100.0);
  CHECK_FALSE(search.step(100.5));
  CHECK(search.counts().empty());
  CHECK_FALSE(search.is_done());
  CHECK(all_of(search, 103.0).size() == 1);
  const auto counts = search.counts();
  search.add(meeting.peer, 104.0);
  CHECK(all_of(search, 110.0).empty());
  CHECK(search.counts() == counts);
}

TEST_CASE("A restarted robot is searched again") {
  const Meeting meeting(6);
  ConstellationSearch search(kSelf);
  search.add(meeting.own, 0.0);
  search.add(meeting.peer, 0.0);
  REQUIRE(all_of(search).size() == 1);
  search.forget(kOther);
  CHECK(all_of(search).empty());
  search.add(meeting.peer, 200.0);
  CHECK(all_of(search, 210.0).size() == 1);
}

TEST_CASE("A stretch has the nearest landmarks of one visit") {
  std::mt19937 rng(7);
  const RobotObjects one = message_of(kSelf, square(5, rng), SE3::Identity(), 1.0, 0.0, rng);
  CHECK(stretches_of(one, 1).size() == 2);  // the third is too near
  CHECK(stretches_of(one, 1)[0].landmarks.size() == 5);
  CHECK(stretches_of(one, 6).empty());
  SECTION("a later visit") {
    RobotObjects later = one;
    for (AnchoredObject& object : later.objects) object.keyframe += 500;
    CHECK(stretches_of(later, 1).empty());
  }
  SECTION("without keyframes") {
    RobotObjects none = one;
    none.keyframes.clear();
    CHECK(stretches_of(none, 1).empty());
  }
  SECTION("sizes of a planet") {
    RobotObjects huge = one;
    for (AnchoredObject& object : huge.objects) object.size_m.setConstant(1e5);
    CHECK(stretches_of(huge, 1).empty());
  }
}

TEST_CASE("A flood of equal objects ends the search without a closure") {
  Meeting meeting(8);
  ConstellationSearch search(kSelf);
  for (RobotObjects* message : {&meeting.own, &meeting.peer}) {
    const AnchoredObject first = message->objects[0];
    message->objects.assign(kMaxObjects, first);
    for (std::size_t n = 0; n < kMaxObjects; ++n)
      message->objects[n].T_kf_box.translation() +=
          Eigen::Vector3d(2.0 * static_cast<double>(n % 40), 2.0 * static_cast<double>(n / 40), 0);
    search.add(*message, 0.0);
  }
  CHECK(all_of(search).empty());
  CHECK(search.is_done());
}

struct NodeChannels {
  [[nodiscard]] ConstellationsTopics ends() {
    return {.own_objects = own,
            .peer_objects = peers,
            .closures = closures,
            .restarts = restarts,
            .found = found,
            .outcomes = outcomes};
  }
  Topic<RobotObjects> own, peers;
  Topic<Closure> closures, found;
  Topic<PeerEvent> restarts;
  Topic<ClosureOutcome> outcomes;
  Inbox<Closure> made{found};
  Inbox<ClosureOutcome> reported{outcomes};
};

TEST_CASE("The started node finds the place, and is then done") {
  std::mt19937 rng(2);
  const auto scene = square(24, rng);
  NodeChannels channels;
  ConstellationsNode node(1, channels.ends());
  node.start();
  CHECK(node.is_done());
  channels.own.publish(message_of(1, scene, random_upright(rng), 1.0, 0.1, rng));
  channels.peers.publish(message_of(2, scene, random_upright(rng), -1.0, 0.1, rng));
  CHECK(eventually([&] { return channels.made.messages().size() == 1; }));
  CHECK(eventually([&] { return node.is_done(); }));
  node.stop();
  CHECK(node.error() == nullptr);
}

}  // namespace
}  // namespace km
