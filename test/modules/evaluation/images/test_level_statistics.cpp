#include "modules/evaluation/images/level_statistics.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "test/modules/evaluation/images/synthetic_images.hpp"

namespace km {
namespace {

constexpr double kNoFlow = std::numeric_limits<double>::quiet_NaN();

// grey(x, y) = 20 + slope * x
cv::Mat ramp(int width, int height, int slope) {
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.at<unsigned char>(y, x) = static_cast<unsigned char>(20 + slope * x);
  return image;
}

double noise_of(const cv::Mat& image) {
  return noise_within(image, gradient_magnitude(image), 2.0);
}

}  // namespace

TEST_CASE("The gradient of a ramp is its slope", "[image_statistics]") {
  const int slope = GENERATE(1, 2, 3);
  const cv::Mat gradient = gradient_magnitude(ramp(64, 48, slope));
  for (int x = 1; x + 1 < gradient.cols; ++x) {
    CAPTURE(x);
    CHECK(gradient.at<float>(20, x) == Approx(slope));
  }
  CHECK(gradient_magnitude(ramp(64, 48, slope).t()).at<float>(20, 20) == Approx(slope));
}

TEST_CASE("The noise of one image is estimated at any grey level and slope", "[image_statistics]") {
  const double sigma = GENERATE(0.7, 1.0, 1.5, 2.5, 4.0);
  CAPTURE(sigma);
  std::mt19937 random(3);
  // Rounding to levels adds 1/12 to the variance. With 150000 pixels the median is known to half a
  // percent; grouping adds one or two percent at the smallest sigma.
  const double expected = std::sqrt(sigma * sigma + 1.0 / 12.0);
  const cv::Mat wall = noisy_wall(480, 320, 128.0, sigma, random);
  CHECK(noise_of(wall) == Approx(expected).epsilon(0.03));
  cv::Mat tilted;
  cv::Mat slope(320, 480, CV_32F);
  for (int y = 0; y < slope.rows; ++y)
    for (int x = 0; x < slope.cols; ++x)
      slope.at<float>(y, x) = 40.0F + 0.3F * static_cast<float>(x);
  cv::Mat(slope + white_noise(480, 320, sigma, random)).convertTo(tilted, CV_8U);
  CHECK(noise_of(tilted) == Approx(expected).epsilon(0.03));
}

TEST_CASE("Noise that is correlated between pixels is underestimated", "[image_statistics]") {
  std::mt19937 random(3);
  cv::Mat smooth, image;
  cv::GaussianBlur(white_noise(480, 320, 8.0, random), smooth, cv::Size(), 1.5);
  smooth.convertTo(image, CV_8U, 1.0, 128.0);
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  CHECK(noise_of(image) < 0.5 * deviation[0]);
}

TEST_CASE("An image without a flat pixel has no noise figure", "[image_statistics]") {
  CHECK(std::isnan(noise_of(ramp(64, 48, 3))));
}

TEST_CASE("The median of rounded magnitudes lies between the integers", "[image_statistics]") {
  CHECK(grouped_median({0, 4, 0}) == Approx(1.0));
  CHECK(grouped_median({4}) == Approx(0.25));
  CHECK(grouped_median({1, 1}) == Approx(0.5));
  CHECK(grouped_median({2, 2, 4, 0}) == Approx(1.5));
  CHECK(std::isnan(grouped_median({0, 0})));
}

TEST_CASE("The Laplacian's variance is that of white noise times its squared weights",
          "[image_statistics]") {
  std::mt19937 random(3);
  const double sigma = 6.0;
  const cv::Mat sharp = noisy_wall(480, 320, 128.0, sigma, random);
  cv::Mat blurred;
  cv::blur(sharp, blurred, cv::Size(5, 1));
  LevelStatistics statistics;
  statistics.add(sharp, sharp, kNoFlow);
  const double weights = 4 * 4 + 4 * 1;  // [0 1 0; 1 -4 1; 0 1 0]
  const double sharpness = figure(figures_of(statistics), "motion blur", "all frames, median");
  CHECK(sharpness == Approx(weights * (sigma * sigma + 1.0 / 12.0)).epsilon(0.02));
  LevelStatistics after;
  after.add(blurred, blurred, kNoFlow);
  CHECK(figure(figures_of(after), "motion blur", "all frames, median") < 0.5 * sharpness);
}

TEST_CASE("Grey levels and exposure steps and blur by flow have the simulated values",
          "[image_statistics]") {
  LevelStatistics statistics;
  const auto wall = [](int grey) { return cv::Mat(100, 100, CV_8UC1, cv::Scalar(grey)); };
  cv::Mat first = wall(100);
  first(cv::Rect(0, 0, 10, 100)).setTo(255);
  first(cv::Rect(10, 0, 20, 100)).setTo(15);
  statistics.add(first, wall(90), kNoFlow);
  statistics.add(wall(110), wall(99), 4.0);
  statistics.add(wall(112), wall(112), 4.0);
  const auto figures = figures_of(statistics);
  const double first_mean = 0.1 * 255 + 0.2 * 15 + 0.7 * 100;
  CHECK(figure(figures, "grey levels", "image mean") == Approx((first_mean + 110 + 112) / 3));
  CHECK(figure(figures, "grey levels", "saturated share max") == Approx(0.1));
  CHECK(figure(figures, "grey levels", "share below 16") == Approx(0.2 / 3));
  CHECK(figure(figures, "exposure", "frame mean min") == Approx(first_mean));
  CHECK(figure(figures, "exposure", "frame mean max") == Approx(112));
  CHECK(figure(figures, "exposure", "step between frames max") == Approx(110 - first_mean));
  CHECK(figure(figures, "exposure", "right over left, mean") ==
        Approx((90 / first_mean + 0.9 + 1.0) / 3));
  CHECK(figure(figures, "gradient", "share above 10") == Approx(4.0 * 100 / 30000).epsilon(0.01));
}

}  // namespace km
