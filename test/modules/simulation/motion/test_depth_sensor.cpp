#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "modules/simulation/motion/depth_sensor.hpp"

namespace km {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr std::size_t kPixels = 320 * 240;

std::vector<float> plane(double z_m) {
  return std::vector<float>(kPixels, static_cast<float>(z_m));
}

TEST_CASE("The ideal depth sensor only rounds to millimetres", "[motion]") {
  DepthSensorOptions options;
  options.ideal = true;
  const DepthSensor sensor(options);
  const std::vector<float> depth = {0.0F, 0.0004F, 1.2344F, 1.2346F, 65.535F, 65.6F};
  const std::vector<std::uint16_t> expected = {0, 0, 1234, 1235, 65535, 0};
  CHECK(sensor.measure(depth, 3, 2, 1) == expected);
}

TEST_CASE("The error of depth grows with the square of range", "[motion]") {
  DepthSensorOptions options;
  options.disparity_step_px = GENERATE(0.0, 1.0 / 16);
  options.correlation_px = GENERATE(1, 4);
  CAPTURE(options.disparity_step_px, options.correlation_px);
  const DepthSensor sensor(options);
  // Rounding to steps adds the variance of a uniform distribution; here noise hides the steps.
  const double step = options.disparity_step_px;
  const double sigma_d = std::sqrt(0.15 * 0.15 + step * step / 12.0);
  for (const double z : {2.0, 4.0, 8.0}) {
    CAPTURE(z);
    double sum = 0.0, squares = 0.0;
    int count = 0;
    for (std::uint64_t seed = 0; seed < 4; ++seed)
      for (const std::uint16_t mm : sensor.measure(plane(z), kWidth, kHeight, seed)) {
        if (mm == 0) continue;
        // Through disparity, in which the error is normal.
        const double error = 458.0 * 0.1 / (mm * 1e-3) - 458.0 * 0.1 / z;
        sum += error;
        squares += error * error;
        ++count;
      }
    REQUIRE(count == 4 * kPixels);
    // Independent nodes: 4 * 76800 / 16, known to 1 / sqrt(2 n) = 0.5 %; millimetres at 2 m add
    // 0.3 mm or 0.003 px.
    CHECK(std::sqrt(squares / count) == Approx(sigma_d).epsilon(0.03));
    CHECK(std::abs(sum / count) < 0.006);
  }
}

TEST_CASE("Depth outside the range and of the sky is a hole", "[motion]") {
  DepthSensorOptions options;
  const DepthSensor sensor(options);
  for (const double z : {0.0, 0.2, 25.0, 1000.0})
    for (const std::uint16_t mm : sensor.measure(plane(z), kWidth, kHeight, 1)) CHECK(mm == 0);
}

TEST_CASE("A nearer box leaves a shadow of its disparity on its left", "[motion]") {
  DepthSensorOptions options;
  options.disparity_noise_px = options.disparity_step_px = options.edge_loss = 0.0;
  const DepthSensor sensor(options);
  std::vector<float> depth = plane(8.0);  // d = 5.7 px
  for (int y = 80; y < 160; ++y)
    for (int x = 120; x < 200; ++x)
      depth[static_cast<std::size_t>(y * kWidth + x)] = 2.0F;  // 22.9 px
  const auto measured = sensor.measure(depth, kWidth, kHeight, 1);
  const auto at = [&](int x, int y) { return measured[static_cast<std::size_t>(y * kWidth + x)]; };
  // Pixels x with x - 5.7 > 120 - 22.9 and left of the box: 103.2 to 119.
  CHECK(at(102, 120) == 8000);
  for (int x = 105; x < 120; ++x) CHECK(at(x, 120) == 0);
  CHECK(at(120, 120) == 2000);
  CHECK(at(199, 120) == 2000);
  CHECK(at(200, 120) == 8000);
  CHECK(at(110, 79) == 8000);
}

TEST_CASE("At edges some pixels are lost, elsewhere none", "[motion]") {
  DepthSensorOptions options;
  const DepthSensor sensor(options);
  std::vector<float> depth = plane(8.0);
  for (int y = 120; y < kHeight; ++y)  // a horizontal edge: nothing is blocked
    for (int x = 0; x < kWidth; ++x) depth[static_cast<std::size_t>(y * kWidth + x)] = 2.0F;
  const auto measured = sensor.measure(depth, kWidth, kHeight, 1);
  int lost_at_edge = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool lost = measured[static_cast<std::size_t>(y * kWidth + x)] == 0;
      if (y == 119 || y == 120)
        lost_at_edge += lost;
      else
        CHECK_FALSE(lost);
    }
  // Half of 640: 6 standard deviations of 12.6.
  CHECK(std::abs(lost_at_edge - 320) < 76);
}

TEST_CASE("Equal seeds give equal depth images, other seeds others", "[motion]") {
  const DepthSensor sensor(DepthSensorOptions{});
  const auto a = sensor.measure(plane(5.0), kWidth, kHeight, 4);
  CHECK(a == sensor.measure(plane(5.0), kWidth, kHeight, 4));
  CHECK(a != sensor.measure(plane(5.0), kWidth, kHeight, 5));
}

TEST_CASE("The depth sensor refuses options and sizes without sense", "[motion]") {
  const auto refused = [](auto change) {
    DepthSensorOptions options;
    change(options);
    CHECK_THROWS_AS(DepthSensor(options), ConfigError);
  };
  refused([](DepthSensorOptions& o) { o.focal_px = 0.0; });
  refused([](DepthSensorOptions& o) { o.baseline_m = -0.1; });
  refused([](DepthSensorOptions& o) { o.disparity_noise_px = std::nan(""); });
  refused([](DepthSensorOptions& o) { o.correlation_px = 0; });
  refused([](DepthSensorOptions& o) { o.max_range_m = 70.0; });
  refused([](DepthSensorOptions& o) { o.min_range_m = 30.0; });  // above max_range_m
  refused([](DepthSensorOptions& o) { o.edge_loss = 1.1; });
  const DepthSensor sensor(DepthSensorOptions{});
  CHECK_THROWS_AS(sensor.measure(plane(5.0), kWidth, kHeight + 1, 1), std::invalid_argument);
  CHECK_THROWS_AS(sensor.measure({}, 0, 0, 1), std::invalid_argument);
}

}  // namespace
}  // namespace km
