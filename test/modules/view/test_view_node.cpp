#include "modules/view/node/view_listener_node.hpp"
#include "modules/view/node/view_node.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/modules/view/watcher.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kSelf = 7;
constexpr double kDt_s = 0.1;  // Time between two ticks.

// Robot with viewers; the test sets the time.
struct Watched {
  explicit Watched(const ViewConfig& config = {})
      : participant(domain, {.robot = kSelf, .name = "alpha", .boot = 9}),
        node(config, participant, camera(),
             {.odometry = odometry,
              .keyframes = keyframes,
              .outcomes = outcomes,
              .restored_outcomes = restored_outcomes,
              .closures = closures,
              .restarts = restarts,
              .objects = objects,
              .maps_2d = maps_2d,
              .images = images}) {
    give(RobotSample{.name = "alpha", .phase = "running"});
  }

  static Camera camera() {
    Camera result;
    result.width = 64;
    result.height = 48;
    result.fx = result.fy = 50.0;
    result.cx = 31.5;
    result.cy = 23.5;
    return result;
  }

  // The node detects a new viewer with the next tick.
  void pass(double seconds) {
    for (const double end_s = now_s + seconds; now_s < end_s; now_s += kDt_s) node.send_due(now_s);
  }
  template <typename T>
  void give(T message) {
    node.step(std::make_shared<const T>(std::move(message)));
  }
  void give_mesh(std::uint32_t side) {
    node.step(ViewMeshOffer{kSelf, std::make_shared<const LabelledMesh>(wavy_sheet(side, 0.1))});
  }
  void give_keyframes(std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      KeyframeOdometry keyframe;
      keyframe.id = {kSelf, static_cast<KeyframeIndex>(k)};
      give(std::move(keyframe));
    }
    give_trajectory(count, 0.0);
  }
  void give_trajectory(std::size_t count, double x_m) {
    SE3 T = SE3::Identity();
    T.translation().x() = x_m;
    PoseChanges changes{kSelf, {}};
    for (std::size_t k = 0; k < count; ++k)
      changes.poses.push_back({{kSelf, static_cast<KeyframeIndex>(k)}, T, {}});
    give(std::move(changes));
  }
  [[nodiscard]] std::size_t sent(ViewChannel channel = ViewChannel::kView) const {
    return node.sent_bytes(channel);
  }

  std::shared_ptr<const DdsDomain> domain = std::make_shared<DdsDomain>(loopback_config());
  DdsParticipant participant;
  Topic<OdometryState> odometry;
  Topic<KeyframeOdometry> keyframes;
  Topic<ClosureOutcome> outcomes, restored_outcomes;
  Topic<Closure> closures;
  Topic<PeerEvent> restarts;
  Topic<ObjectList> objects;
  Topic<OccupancyGrid> maps_2d;
  Topic<TrackedImage> images;
  double now_s = 1000.0;
  ViewNode node;
};

// Viewer that has discovered the robot.
struct Visitor {
  explicit Visitor(Watched& robot) : listener(robot.domain) {
    REQUIRE(eventually([&] {
      robot.pass(kDt_s);
      receive_all();
      return !watcher.states.empty();
    }));
  }
  void receive_all() {
    while (auto update = listener.next(0.0)) watcher.receive(update->content);
  }
  [[nodiscard]] std::size_t faces() const {
    std::size_t count = 0;
    for (const PlacedChunk& placed : watcher.mesh.placed()) count += placed.chunk->faces.size();
    return count;
  }

  ViewListener listener;
  Watcher watcher;
};

}  // namespace

TEST_CASE("Without viewers nothing is sent") {
  Watched robot;
  robot.give_keyframes(100);
  robot.give_mesh(20);
  robot.pass(60.0);
  for (const auto channel : {ViewChannel::kView, ViewChannel::kMesh, ViewChannel::kImages})
    CHECK(robot.sent(channel) == 0);
}

TEST_CASE("Earlier and new data are sent within their budgets") {
  const ViewConfig config = {};
  Watched robot(config);
  constexpr std::size_t kKeyframes = 3000;  // 108 kB of odometry, and 84 kB as optimised.
  robot.give_keyframes(kKeyframes);
  const double begin_s = robot.now_s;
  Visitor visitor(robot);
  const double come_s = robot.now_s;
  const double slack = static_cast<double>(ViewSelector::kUpdateBytes) + 200.0;
  const auto sent = [&] { return static_cast<double>(robot.sent()); };
  constexpr double kPast_bytes = (36.0 + 28.0) * kKeyframes;
  while (sent() < kPast_bytes) {
    robot.pass(kDt_s);
    REQUIRE(sent() <= config.past_bytes_per_s() * (robot.now_s - begin_s + 0.5) + slack);
    REQUIRE(robot.now_s - come_s < kPast_bytes / config.past_bytes_per_s() + 2.0);
  }
  CHECK(eventually([&] {
    robot.pass(kDt_s);
    visitor.receive_all();
    return visitor.watcher.odometry.size() == kKeyframes &&
           visitor.watcher.optimized.size() == kKeyframes;
  }));

  // More moves than the budget allows to send.
  robot.pass(5.0);
  const double present_s = robot.now_s;
  const std::size_t present = robot.sent();
  double x_m = 0.0;
  while (robot.now_s < present_s + 60.0) {
    robot.give_trajectory(kKeyframes, x_m += 1.0);
    robot.pass(1.0);
  }
  const double rate = static_cast<double>(robot.sent() - present) / (robot.now_s - present_s);
  CHECK(rate <= config.bytes_per_s + (0.5 * config.bytes_per_s + slack) / 60.0);
  CHECK(rate > 0.9 * config.bytes_per_s);
}

TEST_CASE("A late viewer receives the full state") {
  Watched robot;
  robot.give_keyframes(50);
  const ClosureId id = closure_id({kSelf, 3}, {4, 9});
  robot.give(ClosureOutcome{.id = id, .stage = ClosureStage::kVerified, .reason = {}});
  robot.give_mesh(60);
  const std::size_t faces = wavy_sheet(60, 0.1).faces.size();
  std::optional<Visitor> first(std::in_place, robot);
  const auto knows_all = [&](Visitor& visitor) {
    return eventually([&] {
      robot.pass(1.0);
      visitor.receive_all();
      const Watcher& watcher = visitor.watcher;
      return watcher.odometry.size() == 50 && watcher.optimized.size() == 50 &&
             watcher.closures.contains(id) && visitor.faces() == faces;
    });
  };
  CHECK(knows_all(*first));
  Visitor second(robot);
  CHECK(knows_all(second));
  first.reset();
  CHECK(eventually([&] {  // Also after the other viewer has gone.
    robot.give_mesh(20);
    robot.pass(1.0);
    second.receive_all();
    return second.faces() == wavy_sheet(20, 0.1).faces.size();
  }));
}

TEST_CASE("Chunks that are removed while a viewer appears are removed for the earlier viewers") {
  ViewConfig config = {};
  config.bytes_per_s = 25.0;  // Slow enough that both events happen between two chunks.
  Watched robot(config);
  robot.give_mesh(60);
  Visitor first(robot);
  const auto knows = [&](Visitor& visitor, std::uint32_t side) {
    return eventually([&] {
      robot.pass(10.0);
      visitor.receive_all();
      return visitor.faces() == wavy_sheet(side, 0.1).faces.size();
    });
  };
  REQUIRE(knows(first, 60));
  robot.give_mesh(20);
  Visitor second(robot);
  CHECK(knows(second, 20));
  CHECK(knows(first, 20));
}

TEST_CASE("Mesh chunks are sent no faster than configured") {
  ViewConfig config = {};
  config.bytes_per_s = 500.0;
  Watched robot(config);
  robot.give_mesh(150);
  Visitor visitor(robot);
  const double begin_s = robot.now_s;
  const std::size_t before = robot.sent(ViewChannel::kMesh);
  const auto sent_since = [&] {
    return static_cast<double>(robot.sent(ViewChannel::kMesh) - before);
  };
  for (int tick = 0; tick < 100; ++tick) {
    robot.pass(kDt_s);
    REQUIRE(sent_since() <=
            config.mesh_bytes_per_s() * (robot.now_s - begin_s + 0.5) + kMaxChunkBytes);
  }
  CHECK(sent_since() > 0.8 * config.mesh_bytes_per_s() * (robot.now_s - begin_s));
}

TEST_CASE("At the end all remaining updates are sent, and no vertex far away") {
  Watched robot;
  std::optional<Visitor> visitor(std::in_place, robot);
  robot.give_keyframes(400);
  LabelledMesh mesh = wavy_sheet(150, 0.1);
  mesh.vertices.back().x() = 1e5F;
  robot.node.step(ViewMeshOffer{kSelf, std::make_shared<const LabelledMesh>(mesh)});
  std::erase_if(mesh.faces, [last = mesh.vertices.size() - 1](const LabelledMesh::Face& face) {
    return std::ranges::find(face, last) != face.end();
  });
  robot.node.start();
  robot.objects.publish(ObjectList{kSelf, {MapObject{.label = 5, .box = {}}}});
  robot.maps_2d.publish(OccupancyGrid{0.05, {0, 0}, 1, 1, {OccupancyGrid::kFree}});
  robot.node.stop();
  const std::size_t sent = robot.sent();
  robot.node.stop();
  CHECK(robot.sent() == sent);
  CHECK(eventually([&] {
    visitor->receive_all();
    return visitor->watcher.optimized.size() == 400 &&
           visitor->watcher.objects.objects.size() == 1 && visitor->watcher.raster.has_value() &&
           visitor->faces() == mesh.faces.size();
  }));
}

TEST_CASE("Images are sent while they are requested") {
  ViewConfig config = {};
  config.images_per_s = 30.0;
  Watched robot(config);
  StereoFrame frame;
  frame.left = {64, 48, std::vector<std::uint8_t>(64 * 48, 100)};
  const auto shared = std::make_shared<const StereoFrame>(std::move(frame));
  Visitor visitor(robot);
  robot.node.start();
  for (int k = 0; k < 20; ++k) robot.images.publish(TrackedImage{shared, {{0.1, 0.2}}});
  CHECK(robot.sent(ViewChannel::kImages) == 0);
  visitor.listener.ask_for_images({kSelf});
  CHECK(eventually([&] {
    robot.images.publish(TrackedImage{shared, {{0.1, 0.2}}});
    visitor.receive_all();
    return !visitor.watcher.images.empty();
  }));
  REQUIRE_FALSE(visitor.watcher.images.empty());
  REQUIRE(visitor.watcher.images[0].features.size() == 1);
  CHECK(visitor.watcher.images[0].features[0][0] == Approx(36.5F));
  CHECK(visitor.watcher.images[0].features[0][1] == Approx(33.5F));
  robot.node.stop();
}

}  // namespace km
