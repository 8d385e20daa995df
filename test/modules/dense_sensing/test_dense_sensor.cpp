#include <catch2/catch.hpp>

#include <algorithm>
#include <memory>

#include "modules/dense_sensing/dense_sensor.hpp"
#include "test/modules/vio/textured_plane.hpp"
#include "test/support/onnx_model.hpp"
#include "test/support/temporary_folder.hpp"

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

TEST_CASE("Recorded depth and labels are not changed", "[dense_sensor]") {
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

TEST_CASE("Labels and colours follow the pixels of rectified depth", "[dense_sensor]") {
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

TEST_CASE("A network labels the left image", "[dense_sensor]") {
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

TEST_CASE("Images that are missing or of the wrong size are reported", "[dense_sensor]") {
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

}  // namespace
}  // namespace km
