#include <catch2/catch.hpp>

#include <cmath>
#include <memory>
#include <vector>

#include "modules/dense_sensing/node/dense_sensing_node.hpp"
#include "test/modules/vio/textured_plane.hpp"

namespace km {
namespace {

constexpr Stamp kPeriod = 50'000'000;  // 20 Hz

// An RGB-D camera half a metre above the body, and a node with a rate of 5 frames a second.
struct Bench {
  StereoRig rig;
  StereoFrame seen;
  Topic<LocatedFrame> located;
  Topic<ShedLoad> load;
  Topic<DenseFrame> frames;
  Topic<DenseSensingProgress> progress;
  std::vector<DenseFrame> published;
  DenseSensingProgress last;
  std::unique_ptr<DenseSensingNode> node;

  explicit Bench(Overflow overflow = Overflow::kBlock) {
    Camera camera = test_rig().cameras[0];
    camera.T_body_cam.translation().z() = 0.5;
    rig = rgbd_rig(camera, 0.1);
    seen = TexturedPlane{}.render_rgbd(rig, SE3::Identity(), 0);
    frames.subscribe([this](const auto& message) { published.push_back(*message); });
    progress.subscribe([this](const auto& message) { last = *message; });
    node = std::make_unique<DenseSensingNode>(DenseSensor(rig, {.labels = LabelsFrom::kImages}),
                                              LabelsFrom::kImages, 5.0, overflow, topics());
  }

  DenseSensingTopics topics() {
    return {.located = located, .load = load, .frames = frames, .progress = progress};
  }

  LocatedFrame frame(int i, bool with_depth) const {
    auto copy = std::make_shared<StereoFrame>(seen);
    copy->stamp = i * kPeriod;
    if (!with_depth) copy->depth = nullptr;
    LocatedFrame result{copy, static_cast<KeyframeIndex>(i / 10), SE3::Identity()};
    result.T_odom_body.translation().x() = i;
    return result;
  }
};

TEST_CASE("Frames are published at the rate with the camera's pose", "[dense_sensing_node]") {
  Bench bench;
  for (int i = 0; i < 41; ++i) bench.node->step(bench.frame(i, true));
  REQUIRE(bench.published.size() == 11);  // 2 s, both ends
  for (std::size_t k = 0; k < bench.published.size(); ++k) {
    const DenseFrame& frame = bench.published[k];
    const int i = 4 * static_cast<int>(k);
    CHECK(frame.stamp == i * kPeriod);
    CHECK(frame.keyframe == static_cast<KeyframeIndex>(i / 10));
    CHECK(frame.T_odom_cam.translation() == Eigen::Vector3d(i, 0.0, 0.5));
    CHECK(frame.depth == bench.seen.depth);
  }
  CHECK(bench.last.frames == 11);
  CHECK(bench.last.without_labels == 11);
}

TEST_CASE("The camera's pose uses the estimated mounting", "[dense_sensing_node]") {
  Bench bench;
  LocatedFrame frame = bench.frame(1, true);
  frame.T_body_rig =
      make_pose(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix(), {0, 0.2, 0});
  bench.node->step(frame);
  REQUIRE(bench.published.size() == 1);
  const Camera& camera = bench.rig.cameras[0];
  const SE3 expected = frame.T_odom_body * frame.T_body_rig * camera.T_body_cam;
  CHECK(bench.published[0].T_odom_cam.isApprox(expected));
  CHECK(expected.translation().y() == Approx(0.2 - 0.5 * std::sin(0.1)));
}

TEST_CASE("The next frame replaces a due frame without depth", "[dense_sensing_node]") {
  Bench bench;
  for (int i = 0; i < 40; ++i) bench.node->step(bench.frame(i, i % 3 == 1));
  REQUIRE(bench.published.size() >= 7);  // every 0.3 s
  CHECK(bench.published.front().stamp == kPeriod);
  CHECK(bench.last.without_depth > 0);
  CHECK(bench.last.frames == bench.published.size());
}

TEST_CASE("Due frames are dropped and counted while odometry needs the processors",
          "[dense_sensing_node]") {
  Bench bench;
  for (int i = 0; i < 41; ++i) {
    if (i == 8) bench.load.publish(ShedLoad{.map = true, .stride = 1});
    if (i == 24) bench.load.publish(ShedLoad{});
    bench.node->step(bench.frame(i, true));
  }
  CHECK(bench.last.dropped_under_load == 4);  // at 8, 12, 16 and 20
  CHECK(bench.last.frames == 7);
  CHECK(bench.published.size() == 7);
}

}  // namespace
}  // namespace km
