#include "modules/core/config.hpp"
#include "modules/images/keypoint_patches.hpp"
#include "modules/loop_closure/keypoint_describer.hpp"
#include "modules/loop_closure/matching.hpp"
#include "test/support/onnx_model.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Number k is the first sample of the patch, times -1 if k is even.
PointwiseNetwork first_sample(std::size_t numbers = kMatchedNumbers) {
  PointwiseNetwork network{.height = kPatchSide, .width = kPatchSide, .stride = kPatchSide};
  for (std::size_t k = 0; k < numbers; ++k) {
    network.weights.push_back({k % 2 == 1 ? 1.0F : -1.0F});
    network.biases.push_back(0.0F);
  }
  return network;
}

KeypointDescriber describer_of(const TemporaryFolder& folder, const PointwiseNetwork& network) {
  return KeypointDescriber(folder.write("net.onnx", network.onnx()));
}

// Corners on the edge between a dark left and a light right half.
std::vector<cv::KeyPoint> corners_on_edge(std::size_t count) {
  std::vector<cv::KeyPoint> corners;
  for (std::size_t i = 0; i < count; ++i) {
    const float angle_deg = i % 3 == 0 ? 0.0F : 180.0F;
    corners.emplace_back(100.0F, 60.0F + static_cast<float>(i % 50), 31.0F, angle_deg, 1.0F, 0);
  }
  return corners;
}

cv::Mat edge() {
  cv::Mat image(200, 200, CV_8U, cv::Scalar(40));
  image.colRange(100, 200) = cv::Scalar(200);
  return image;
}

TEST_CASE("A descriptor is the direction of the network's numbers for the patch") {
  const TemporaryFolder folder;
  KeypointDescriber describer = describer_of(folder, first_sample());
  CHECK(describer.network() != 0);
  const std::size_t count = GENERATE(1, 64, 150);  // whole and broken batches
  const auto descriptors = describer.describe(edge(), corners_on_edge(count));
  REQUIRE(descriptors.size() == count);
  for (std::size_t i = 0; i < count; ++i) {
    const int dark = i % 3 == 0 ? -4 : 4;  // the first sample is on the left
    const auto numbers = numbers_of(descriptors[i]);
    for (std::size_t k = 0; k < numbers.size(); ++k)
      CHECK(numbers[k] == (k % 2 == 1 ? dark : -dark));
  }
  CHECK(describer.describe(edge(), {}).empty());
}

TEST_CASE("A patch of one grey level has a descriptor") {
  const TemporaryFolder folder;
  const cv::Mat flat(200, 200, CV_8U, cv::Scalar(90));
  const auto found = describer_of(folder, first_sample()).describe(flat, corners_on_edge(2));
  REQUIRE(found.size() == 2);
  for (const int number : numbers_of(found[0])) CHECK(number == 0);
}

TEST_CASE("A network of another input or output is refused with its file and the reason") {
  const TemporaryFolder folder;
  PointwiseNetwork small = first_sample();
  small.height = 8;
  const auto [content, reason] = GENERATE_COPY(
      std::pair<std::string, std::string>{small.onnx(), "its input is 1 x 1 x 8 x 24"},
      std::pair<std::string, std::string>{first_sample(96).onnx(), "not 24 each"},
      std::pair<std::string, std::string>{"no network", "cannot be run as ONNX"});
  const auto file = folder.write("other.onnx", content);
  CHECK_THROWS_WITH(KeypointDescriber(file), Contains(reason) && Contains(file.string()) &&
                                                 Contains("keyframe_features.network"));
}

TEST_CASE("The shipped network gives the numbers of its training") {
  cv::Mat image(240, 240, CV_8U);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(128.0 + 60.0 * std::sin(0.12 * (x - 120)) +
                                          50.0 * std::cos(0.09 * (y - 120) + 0.05 * (x - 120)));
  const auto found = KeypointDescriber("config/networks/keypoints.onnx")
                         .describe(image, std::vector{cv::KeyPoint(120, 120, 31, 0, 1, 0)});
  REQUIRE(found.size() == 1);
  // As computed by torch after the training, without the smoothing of the image.
  const std::vector<int> expected = {0,  -5, 2, 7, 4,  1,  1,  -2, 2,  4,  -1, -1,
                                     -4, 0,  1, 1, -4, -6, -5, 3,  -2, -2, 2,  1};
  const auto numbers = numbers_of(found[0]);
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(std::abs(numbers[i] - expected[i]) <= 1);
}

}  // namespace
}  // namespace km
