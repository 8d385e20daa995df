#include "modules/dense_sensing/segmentation_network.hpp"
#include "test/support/onnx_model.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// For an input in [0, 1]: class 0 below 0.3, class 1 to 0.7, class 2 above.
PointwiseNetwork three_levels() {
  PointwiseNetwork network;
  network.weights = {{0.0F}, {1.0F}, {2.0F}};
  network.biases = {0.0F, -0.3F, -1.0F};
  return network;
}

SegmentationConfig config_of(const fs::path& file) {
  SegmentationConfig config;
  config.network = file.string();
  config.width_px = 16;
  config.height_px = 8;
  config.channels = 1;
  return config;
}

// Vertical stripes of grey levels 40, 128, 220, equally wide.
GrayImage stripes(int width, int height) {
  GrayImage image{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int stripe = 4 * x / width;  // the last is like the first
      image.pixels.push_back(stripe == 1 ? 128 : stripe == 2 ? 220 : 40);
    }
  return image;
}

TEST_CASE("A network labels every pixel by the class with the best score") {
  const TemporaryFolder folder;
  SegmentationNetwork network(config_of(folder.write("net.onnx", three_levels().onnx())));
  const Segmentation result = network.segment(stripes(16, 8));
  CHECK(result.unmapped_pixels == 0);
  REQUIRE(result.labels.ids.size() == 16 * 8);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 16; ++x) {
      const int stripe = x / 4;
      CHECK(int{result.labels.ids[static_cast<std::size_t>(16 * y + x)]} ==
            (stripe == 3 ? 0 : stripe));
    }
}

TEST_CASE("Mean, scale and channels are applied before the network") {
  const TemporaryFolder folder;
  PointwiseNetwork three = three_levels();
  three.channels = 3;
  three.weights = {{0, 0, 0}, {0.5F, 0.25F, 0.25F}, {1, 0.5F, 0.5F}};
  SegmentationConfig config = config_of(folder.write("net.onnx", three.onnx()));
  config.channels = 3;
  config.mean = 100.0;
  config.scale = 0.01;  // 128 becomes 0.28, 220 becomes 1.2, 40 is negative
  SegmentationNetwork network(config);
  const Segmentation result = network.segment(stripes(16, 8));
  CHECK(int{result.labels.ids[1]} == 0);
  CHECK(int{result.labels.ids[5]} == 0);
  CHECK(int{result.labels.ids[9]} == 2);
}

TEST_CASE("Classes become the labels of the map and further classes are counted") {
  const TemporaryFolder folder;
  SegmentationConfig config = config_of(folder.write("net.onnx", three_levels().onnx()));
  config.label_map = {"7", "9"};
  SegmentationNetwork network(config);
  const Segmentation result = network.segment(stripes(16, 8));
  CHECK(int{result.labels.ids[1]} == 7);
  CHECK(int{result.labels.ids[5]} == 9);
  CHECK(int{result.labels.ids[9]} == 0);
  CHECK(result.unmapped_pixels == 4 * 8);
}

TEST_CASE("A single plane holds class numbers") {
  const TemporaryFolder folder;
  PointwiseNetwork numbers;
  numbers.weights = {{255.0F}};  // the grey level again
  numbers.biases = {-38.0F};
  SegmentationNetwork network(config_of(folder.write("net.onnx", numbers.onnx())));
  const Segmentation result = network.segment(stripes(16, 8));
  CHECK(int{result.labels.ids[1]} == 2);
  CHECK(int{result.labels.ids[5]} == 90);
  CHECK(int{result.labels.ids[9]} == 182);
}

TEST_CASE("A network that cannot be used is refused with the reason") {
  const TemporaryFolder folder;
  const auto fails_with = [](const SegmentationConfig& config, const std::string& words) {
    CAPTURE(words);
    CHECK_THROWS_AS(SegmentationNetwork(config), ConfigError);
    CHECK_THROWS_WITH(SegmentationNetwork(config), Contains(words));
  };
  fails_with(config_of(folder.path() / "none.onnx"), "no such file");
  fails_with(config_of(folder.write("text.onnx", "no network at all")), "cannot be run as ONNX");
  const std::string whole = three_levels().onnx();
  fails_with(config_of(folder.write("half.onnx", whole.substr(0, whole.size() / 2))),
             "cannot be run as ONNX");

  PointwiseNetwork three = three_levels();
  three.channels = 3;
  three.weights = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  SegmentationConfig config = config_of(folder.write("three.onnx", three.onnx()));
  fails_with(config, "does not run on an image of 16 x 8 px with 1 channels");
  config.network = folder.write("net.onnx", whole);
  config.channels = 2;
  fails_with(config, "neither 1 nor 3");
  config.channels = 1;
  config.label_map = {"1", "road"};
  fails_with(config, "'road' of class 1");
  config.label_map = {"256"};
  fails_with(config, "'256' of class 0");
}

}  // namespace
}  // namespace km
