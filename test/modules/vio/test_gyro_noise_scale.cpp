#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "modules/vio/gyro_noise_scale.hpp"

namespace km {
namespace {

constexpr double kSigma_rad = 1e-3;

// After `seconds` of images, 20 a second, that differ by `sigmas` standard deviations per axis.
double scale_after(GyroNoiseScale& noise, double sigmas, double seconds) {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal(0.0, sigmas * kSigma_rad);
  for (int k = 0; k < static_cast<int>(20.0 * seconds); ++k) {
    const double x = normal(rng), y = normal(rng), z = normal(rng);
    noise.add(std::sqrt(x * x + y * y + z * z), 3.0 * kSigma_rad * kSigma_rad, 0.05);
  }
  return noise.scale();
}

TEST_CASE("The scale of the gyroscope's noise follows the images within bounds", "[vio]") {
  GyroNoiseScale noise;
  CHECK(noise.scale() == 1.0);
  CHECK(scale_after(noise, 0.5, 30.0) == 1.0);
  CHECK(scale_after(noise, 2.0, 30.0) == Approx(2.0).margin(0.4));
  CHECK(scale_after(noise, 100.0, 30.0) == Approx(GyroNoiseScale::kMaxScale).margin(1e-3));
  CHECK(scale_after(noise, 0.5, 30.0) == 1.0);
}

TEST_CASE("Neither a diverged estimate nor one image changes the noise of the gyroscope", "[vio]") {
  const double difference_rad = GENERATE(std::numeric_limits<double>::quiet_NaN(), 1.0);
  GyroNoiseScale noise;
  noise.add(difference_rad, 3.0 * kSigma_rad * kSigma_rad, 0.05);
  CHECK(noise.scale() == 1.0);
  CHECK(scale_after(noise, 2.0, 30.0) == Approx(2.0).margin(0.4));
}

}  // namespace
}  // namespace km
