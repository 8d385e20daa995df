#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/dense_sensing/node/dense_sensing_node.hpp"
#include "test/modules/vio/textured_plane.hpp"
#include "test/support/onnx_model.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Label 1 left of the optical axis, label 2 right of it.
std::shared_ptr<const LabelImage> halves(const Camera& camera) {
  auto labels = std::make_shared<LabelImage>(LabelImage{camera.width, camera.height, {}});
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const auto bearing = camera.unproject(Eigen::Vector2d(x, y));
      labels->ids.push_back(bearing && bearing->x() < 0.0 ? 1 : 2);
    }
  return labels;
}

TEST_CASE("Recorded depth and labels are not changed") {
  const StereoRig rig = rgbd_rig(test_rig().cameras[0], 0.1);
  DenseSensor sensor(rig, {.labels = LabelsFrom::kImages});
  CHECK(sensor.camera().lens == rig.cameras[0].lens);
  StereoFrame frame = TexturedPlane{}.render_rgbd(rig, SE3::Identity(), 5);
  frame.labels = halves(rig.cameras[0]);
  const DenseImages images = sensor.sense(frame);
  CHECK(images.problem == DenseProblem::kNone);
  CHECK(images.depth == frame.depth);
  CHECK(images.labels == frame.labels);
  REQUIRE(images.color != nullptr);
  CHECK(images.color->pixels.at(5)[1] == frame.left.pixels.at(5));
  frame.decode_color = [&] {
    const std::size_t pixels = frame.left.pixels.size();
    return ColorImage{frame.left.width, frame.left.height,
                      std::vector<ColorImage::Pixel>(pixels, {200, 100, 20})};
  };
  CHECK(sensor.sense(frame).color->pixels.at(5) == ColorImage::Pixel{200, 100, 20});
  DenseSensor metric(rig, {});
  CHECK(metric.sense(frame).labels == nullptr);
}

TEST_CASE("Labels and colours follow the pixels of rectified depth") {
  const StereoRig rig = test_rig();
  DenseSensorConfig config{.depth = DepthFrom::kStereo, .labels = LabelsFrom::kImages};
  config.stereo.downscale = GENERATE(1, 2);
  DenseSensor sensor(rig, config);
  StereoFrame frame = TexturedPlane{}.render(rig, SE3::Identity(), 5);
  frame.labels = halves(rig.cameras[0]);
  frame.decode_color = [&] {  // the labels as colours
    ColorImage color{frame.left.width, frame.left.height, {}};
    for (const LabelId label : frame.labels->ids) color.pixels.push_back({label, 0, 0});
    return color;
  };
  const DenseImages images = sensor.sense(frame);
  REQUIRE(images.problem == DenseProblem::kNone);
  REQUIRE(images.labels != nullptr);
  REQUIRE(images.color->pixels.size() == images.labels->ids.size());
  CHECK(std::ranges::equal(images.color->pixels, images.labels->ids, {},
                           [](const ColorImage::Pixel& pixel) { return LabelId{pixel[0]}; }));
  const Camera& camera = sensor.camera();
  REQUIRE(images.labels->width == camera.width);
  CHECK(images.depth->width == camera.width);
  const double margin = 1.0 / camera.fx;  // half a pixel there, half one in the real image
  const SE3 T_left_cam = rig.cameras[0].T_body_cam.inverse() * camera.T_body_cam;
  for (int y = 0; y < camera.height; y += 7)
    for (int x = 0; x < camera.width; ++x) {
      const auto bearing = camera.unproject(Eigen::Vector2d(x, y));
      const double side = (T_left_cam.linear() * bearing->homogeneous()).hnormalized().x();
      const int label =
          images.labels->ids[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                             static_cast<std::size_t>(x)];
      if (std::abs(side) > margin && label != 0) CHECK(label == (side < 0.0 ? 1 : 2));
    }
}

TEST_CASE("A network labels the left image") {
  const TemporaryFolder folder;
  PointwiseNetwork network;  // dark 0, bright 1
  network.weights = {{0.0F}, {1.0F}};
  network.biases = {0.0F, -0.5F};
  const StereoRig rig = rgbd_rig(test_rig().cameras[0], 0.1);
  DenseSensorConfig config{.labels = LabelsFrom::kNetwork};
  config.segmentation.network = folder.write("net.onnx", network.onnx());
  config.segmentation.width_px = 16;
  config.segmentation.height_px = 8;
  config.segmentation.channels = 1;
  config.segmentation.label_map = {"4"};
  DenseSensor sensor(rig, config);
  StereoFrame frame = TexturedPlane{}.render_rgbd(rig, SE3::Identity(), 5);
  frame.left = flat_image(rig.cameras[0], 20);
  CHECK(sensor.sense(frame).labels->ids.front() == 4);
  frame.left = flat_image(rig.cameras[0], 200);
  const DenseImages images = sensor.sense(frame);
  CHECK(images.unmapped_pixels == images.labels->ids.size());
}

TEST_CASE("Images that are missing or of the wrong size are reported") {
  const StereoRig rig = test_rig();
  const StereoRig depth_rig = rgbd_rig(rig.cameras[0], 0.1);
  DenseSensor recorded(depth_rig, {.labels = LabelsFrom::kImages});
  StereoFrame frame = TexturedPlane{}.render_rgbd(depth_rig, SE3::Identity(), 5);
  auto labels = std::make_shared<LabelImage>(*halves(rig.cameras[0]));
  labels->height /= 2;
  frame.labels = labels;
  const DenseImages cut = recorded.sense(frame);
  CHECK(cut.problem == DenseProblem::kNone);
  CHECK(cut.wrong_label_size);
  CHECK(cut.labels == nullptr);
  auto depth = std::make_shared<DepthImage>(*frame.depth);
  depth->millimetres.pop_back();
  frame.depth = depth;
  CHECK(recorded.sense(frame).problem == DenseProblem::kWrongSize);
  frame.depth = nullptr;
  CHECK(recorded.sense(frame).problem == DenseProblem::kNoDepthImage);

  DenseSensor stereo(rig, {.depth = DepthFrom::kStereo});
  CHECK(stereo.sense(frame).problem == DenseProblem::kWrongSize);  // no right image
}

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

TEST_CASE("Frames are published at the rate with the camera's pose") {
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

TEST_CASE("The camera's pose uses the estimated mounting") {
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

TEST_CASE("The next frame replaces a due frame without depth") {
  Bench bench;
  for (int i = 0; i < 40; ++i) bench.node->step(bench.frame(i, i % 3 == 1));
  REQUIRE(bench.published.size() >= 7);  // every 0.3 s
  CHECK(bench.published.front().stamp == kPeriod);
  CHECK(bench.last.without_depth > 0);
  CHECK(bench.last.frames == bench.published.size());
}

TEST_CASE("Due frames are dropped and counted while odometry needs the processors") {
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
