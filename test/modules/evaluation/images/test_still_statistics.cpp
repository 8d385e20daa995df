#include "modules/evaluation/images/still_statistics.hpp"

#include <catch2/catch.hpp>

#include "test/modules/evaluation/images/synthetic_images.hpp"

namespace km {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr Stamp kSecond = 1'000'000'000;

// Blobs on the left, a plain wall with a little constant noise on the right.
cv::Mat scene(int shift_px) {
  const cv::Mat surface = texture(kWidth + 8, kHeight, 5);
  cv::Mat image = view_of(surface, shift_px, 0, kWidth, kHeight);
  image(cv::Rect(kWidth / 2, 0, kWidth / 2, kHeight)).setTo(140);
  return image;
}

void add(StillStatistics& statistics, double t_s, const cv::Mat& scene, double sigma,
         std::mt19937& random) {
  cv::Mat exact, image;
  scene.convertTo(exact, CV_32F);
  cv::Mat(exact + white_noise(kWidth, kHeight, sigma, random)).convertTo(image, CV_8U);
  const KltImage klt = make_klt_image(image);
  statistics.add(nanoseconds(t_s) + kSecond, klt, corners_of(klt.image));
}

}  // namespace

TEST_CASE("Noise over time is estimated while the camera stands still", "[image_statistics]") {
  const double sigma = GENERATE(1.0, 2.0);
  CAPTURE(sigma);
  std::mt19937 random(9);
  StillStatistics statistics;
  for (int i = 0; i <= 4; ++i) add(statistics, 0.5 * i, scene(0), sigma, random);
  CHECK(statistics.pairs() == 3);
  const double expected = std::sqrt(sigma * sigma + 1.0 / 12.0);  // and rounding to levels
  const auto figures = figures_of(statistics);
  // Flat pixels are selected by the noisy image itself, which reduces its noise a little.
  const double selection = 0.05;
  CHECK(figure(figures, "standing", "temporal noise, flat pixels [levels]") ==
        Approx(expected).epsilon(selection));
  CHECK(figure(figures, "standing", "the same, robust") == Approx(expected).epsilon(selection));
  CHECK(figure(figures, "standing", "temporal noise, grey 110-200") ==
        Approx(expected).epsilon(selection));
  CHECK(figure(figures, "standing", "KLT jitter per axis [px]") < 0.1);
}

TEST_CASE("A camera that moves gives no noise over time", "[image_statistics]") {
  std::mt19937 random(9);
  StillStatistics statistics;
  for (int i = 0; i <= 4; ++i) add(statistics, 0.5 * i, scene(i), 1.0, random);
  CHECK(statistics.pairs() == 0);
  CHECK(std::isnan(figure(figures_of(statistics), "standing", "KLT jitter per axis [px]")));
}

}  // namespace km
