#include "modules/images/keypoint_extractor.hpp"
#include "modules/images/keypoint_patches.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Grey levels that are a function of the pixel.
cv::Mat image_of(auto&& grey) {
  cv::Mat image(240, 240, CV_8U);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey(x, y));
  return image;
}

cv::KeyPoint corner(float x, float y, float angle_deg, int octave = 0) {
  return {x, y, 31.0F, angle_deg, 1.0F, octave};
}

int sample(const cv::Mat& patches, int row, int u, int v) {
  return patches.at<std::uint8_t>(row, v * kPatchSide + u);
}

TEST_CASE("Samples are two pixels of the octave apart along the corner's axes") {
  const cv::Mat ramp = image_of([](int x, int) { return x; });
  const int octave = GENERATE(0, 3, 7);
  const double step = kPatchSpacing_px * std::pow(kPyramidScale, octave);
  const std::vector<cv::KeyPoint> corners = {
      corner(120, 130, 0, octave), corner(120, 130, 90, octave), corner(120, 130, 180, octave)};
  const cv::Mat patches = keypoint_patches(ramp, corners);
  REQUIRE(patches.rows == 3);
  const double off = 1.0 + 0.5 * std::pow(kPyramidScale, octave);  // by rounding to pixels
  for (const int u : {0, 5, 23})
    for (const int v : {0, 12, 23}) {
      const double right = step * (u - 11.5), down = step * (v - 11.5);
      CHECK(std::abs(sample(patches, 0, u, v) - (120 + right)) <= off);
      CHECK(std::abs(sample(patches, 1, u, v) - (120 - down)) <= off);
      CHECK(std::abs(sample(patches, 2, u, v) - (120 - right)) <= off);
    }
}

TEST_CASE("A turned image with turned corners has similar patches") {
  const float turn_deg = GENERATE(20.0F, 90.0F, 200.0F);
  const double turn = static_cast<double>(turn_deg) * std::numbers::pi / 180.0;
  const auto grey = [](double x, double y) {  // about the centre of the image
    return 128.0 + 60.0 * std::sin(0.12 * x) + 50.0 * std::cos(0.09 * y + 0.05 * x);
  };
  const cv::Mat upright = image_of([&](int x, int y) { return grey(x - 120, y - 120); });
  const cv::Mat turned = image_of([&](int x, int y) {
    const double c = std::cos(turn), s = std::sin(turn);
    return grey(c * (x - 120) + s * (y - 120), -s * (x - 120) + c * (y - 120));
  });
  const cv::Mat a = keypoint_patches(upright, std::vector{corner(120, 120, 30)});
  const cv::Mat b = keypoint_patches(turned, std::vector{corner(120, 120, 30 + turn_deg)});
  const cv::Mat unturned = keypoint_patches(turned, std::vector{corner(120, 120, 30)});
  const double samples = a.cols;
  CHECK(cv::norm(a, b, cv::NORM_L1) / samples < 4.0);
  CHECK(cv::norm(a, unturned, cv::NORM_L1) / samples > 20.0);
}

TEST_CASE("Samples beyond the border repeat it") {
  const cv::Mat ramp = image_of([](int x, int y) { return (x + y) / 2; });
  const cv::Mat patches = keypoint_patches(ramp, std::vector{corner(0, 0, 0), corner(239, 239, 0)});
  CHECK(sample(patches, 0, 0, 0) == sample(patches, 0, 11, 11));
  CHECK(sample(patches, 1, 23, 23) == sample(patches, 1, 12, 12));
  CHECK(keypoint_patches(ramp, {}).rows == 0);
}

}  // namespace
}  // namespace km
