#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "apps/lab/simulation/rendering/sensor_effects.hpp"
#include "modules/core/lie.hpp"
#include "test/apps/lab/simulation/rendering/small_world.hpp"

namespace km {
namespace {

using small_world::distorted_camera;
using small_world::forward_camera;

RenderedView flat_view(const Camera& camera, float radiance) {
  RenderedView view;
  view.width = camera.width;
  view.height = camera.height;
  const auto n = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  view.radiance.assign(n, radiance);
  view.rgb.assign(n, radiance * Eigen::Vector3f(1.0F, 0.5F, 0.25F));
  view.depth_m.assign(n, 2.0F);
  return view;
}

RenderedView evenly_lit(float radiance) {
  return flat_view(forward_camera(8, 8, 8.0), radiance);
}

TEST_CASE("The first frame is exposed to its target", "[simulation][exposure]") {
  const double gamma = GENERATE(1.0, 2.2);
  SensorEffectsConfig config;
  config.gamma = gamma;
  ExposureControl control(config, 20.0);
  const Exposure exposure = control.next(evenly_lit(0.2F));
  const double level = std::pow(0.2 * exposure.gain, 1.0 / gamma);
  CHECK(level == Approx(config.target_level).epsilon(1e-3));
}

TEST_CASE("The exposure follows a change of light with a lag, and settles",
          "[simulation][exposure]") {
  SensorEffectsConfig config;
  config.adaptation = 0.1;
  ExposureControl control(config, 20.0);
  (void)control.next(evenly_lit(0.8F));
  const RenderedView dark = evenly_lit(0.1F);
  double last = 0.0;
  double first_level = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double level = control.next(dark).gain * 0.1;
    CHECK(level > last);  // no overshoot
    if (i == 0) first_level = level;
    last = level;
  }
  CHECK(first_level < 0.6 * config.target_level);
  CHECK(last == Approx(config.target_level).epsilon(0.01));
}

TEST_CASE("The pace of adaptation does not depend on the frame rate", "[simulation][exposure]") {
  const auto gain_after_one_second = [](double rate_hz) {
    ExposureControl control({}, rate_hz);
    (void)control.next(evenly_lit(0.8F));
    double gain = 0.0;
    for (int i = 0; i < static_cast<int>(rate_hz); ++i) gain = control.next(evenly_lit(0.3F)).gain;
    return gain;
  };
  CHECK(gain_after_one_second(10.0) == Approx(gain_after_one_second(40.0)).epsilon(0.02));
}

TEST_CASE("A dark scene opens the shutter to its limit", "[simulation][exposure]") {
  const SensorEffectsConfig config;
  ExposureControl bright(config, 20.0);
  const Exposure short_time = bright.next(evenly_lit(1.0F));
  CHECK(short_time.time_s == Approx(short_time.gain * config.unit_exposure_s));
  ExposureControl dim(config, 20.0);
  CHECK(dim.next(evenly_lit(0.01F)).time_s == config.max_exposure_s);
}

TEST_CASE("Exposure refuses unusable options", "[simulation][exposure]") {
  CHECK_THROWS_AS(ExposureControl({}, 0.0), std::invalid_argument);
  SensorEffectsConfig config;
  config.target_level = 2.0;
  CHECK_THROWS_AS(ExposureControl(config, 20.0), ConfigError);
  ExposureControl control({}, 20.0);
  CHECK_THROWS_AS(control.next(RenderedView{}), std::invalid_argument);
}

SensorEffectsConfig clean() {
  SensorEffectsConfig config;
  config.vignetting = 0.0;
  config.lens_blur_px = 0.0;
  config.read_noise = 0.0;
  config.photon_noise = 0.0;
  return config;
}

Shot shot(double gain, std::uint64_t seed = 0) {
  Shot result;
  result.exposure = {gain, 0.005};
  result.noise_seed = seed;
  return result;
}

TEST_CASE("Grey levels are the response to the exposed light", "[simulation][sensor]") {
  const double gamma = GENERATE(1.0, 1.7);
  const double signal = GENERATE(0.0, 0.002, 0.1, 0.5, 0.99, 1.0, 3.0);
  CAPTURE(gamma, signal);
  SensorEffectsConfig config = clean();
  config.gamma = gamma;
  const Camera camera = forward_camera(4, 4, 4.0);
  const SensorEffects effects(PixelRays(camera), config);
  const GrayImage image =
      effects.gray(flat_view(camera, static_cast<float>(signal / 2.0)), shot(2.0));
  const double expected = 255.0 * std::pow(std::min(signal, 1.0), 1.0 / gamma);
  for (const std::uint8_t level : image.pixels) CHECK(std::abs(level - expected) <= 0.51);
}

TEST_CASE("The corners lose the configured share of light", "[simulation][sensor]") {
  SensorEffectsConfig config = clean();
  config.vignetting = 0.3;
  const Camera camera = forward_camera(101, 75, 60.0);
  const SensorEffects effects(PixelRays(camera), config);
  const GrayImage image = effects.gray(flat_view(camera, 0.8F), shot(1.0));
  CHECK(image.pixels[37 * 101 + 50] == std::lround(255 * 0.8));
  for (const std::size_t corner : {0UL, 100UL, 74UL * 101UL, 75UL * 101UL - 1UL})
    CHECK(std::abs(image.pixels[corner] - 255 * 0.8 * 0.7) <= 1.0);
}

struct Statistics {
  double mean = 0.0;
  double deviation = 0.0;
  double neighbours = 0.0;  // correlation of horizontal neighbours
};

Statistics statistics_of(const GrayImage& image) {
  const auto n = static_cast<double>(image.pixels.size());
  Statistics s;
  for (const std::uint8_t level : image.pixels) s.mean += level / n;
  double products = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    s.deviation += std::pow(image.pixels[i] - s.mean, 2) / n;
    if (i > 0) products += (image.pixels[i] - s.mean) * (image.pixels[i - 1] - s.mean) / n;
  }
  s.neighbours = products / s.deviation;
  s.deviation = std::sqrt(s.deviation);
  return s;
}

TEST_CASE("Noise has the strength and the correlation that are configured",
          "[simulation][sensor]") {
  const double level = GENERATE(0.1, 0.5, 0.8);
  const double correlation_px = GENERATE(0.0, 1.5);
  CAPTURE(level, correlation_px);
  SensorEffectsConfig config = clean();
  config.read_noise = 3.0;
  config.photon_noise = 4.0;
  config.noise_correlation_px = correlation_px;
  const Camera camera = forward_camera(320, 240, 200.0);
  const SensorEffects effects(PixelRays(camera), config);
  const Statistics s =
      statistics_of(effects.gray(flat_view(camera, static_cast<float>(level)), shot(1.0, 7)));
  // 1/12 is the variance that rounding to whole levels adds.
  const double expected = std::sqrt(9.0 + 16.0 * level + 1.0 / 12.0);
  CHECK(s.mean == Approx(255.0 * level).margin(0.2));
  CHECK(s.deviation == Approx(expected).epsilon(0.06));
  if (correlation_px == 0.0) CHECK(std::abs(s.neighbours) < 0.03);
  // White noise smoothed by a Gaussian of sigma: exp(-1 / (4 sigma^2)) one pixel on.
  if (correlation_px > 0.0)
    CHECK(s.neighbours == Approx(std::exp(-1.0 / (4.0 * 1.5 * 1.5))).margin(0.05));
}

TEST_CASE("Noise is a function of the seed", "[simulation][sensor]") {
  const Camera camera = forward_camera(64, 48, 60.0);
  const SensorEffects effects(PixelRays(camera), {});
  const RenderedView view = flat_view(camera, 0.5F);
  CHECK(effects.gray(view, shot(1.0, 1)).pixels == effects.gray(view, shot(1.0, 1)).pixels);
  CHECK(effects.gray(view, shot(1.0, 1)).pixels != effects.gray(view, shot(1.0, 2)).pixels);
}

TEST_CASE("Amplification raises the noise if the shutter cannot open longer",
          "[simulation][sensor]") {
  SensorEffectsConfig config = clean();
  config.read_noise = 2.0;
  const Camera camera = forward_camera(160, 120, 100.0);
  const SensorEffects effects(PixelRays(camera), config);
  Shot amplified = shot(3.0);
  amplified.exposure.time_s = config.unit_exposure_s;  // three times too short
  const Statistics s = statistics_of(effects.gray(flat_view(camera, 0.1F), amplified));
  CHECK(s.deviation == Approx(6.0).epsilon(0.06));
}

TEST_CASE("Colour is developed channel by channel", "[simulation][sensor]") {
  const Camera camera = forward_camera(4, 4, 4.0);
  const SensorEffects effects(PixelRays(camera), clean());
  const ColorImage image = effects.color(flat_view(camera, 0.8F), shot(1.0));
  REQUIRE(image.pixels.size() == 48);
  for (std::size_t i = 0; i < 48; i += 3) {
    CHECK(image.pixels[i] == 204);
    CHECK(image.pixels[i + 1] == 102);
    CHECK(image.pixels[i + 2] == 51);
  }
}

// Light of an image, and its centre of mass relative to the pixel `center`.
struct LightMoments {
  double mass = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
};

LightMoments moments_of(const std::vector<float>& image, int width, const Eigen::Vector2d& center) {
  LightMoments m;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const int k = static_cast<int>(i);
    const auto value = static_cast<double>(image[i]);
    const Eigen::Vector2d d = Eigen::Vector2d(k % width, k / width) - center;
    m.mass += value;
    m.mean += value * d;
    m.spread += value * d * d.transpose();
  }
  return m;
}

TEST_CASE("The lens spreads a point as it is configured and keeps its light",
          "[simulation][sensor]") {
  const double sigma_px = GENERATE(0.6, 1.0, 2.5);
  CAPTURE(sigma_px);
  constexpr int kWidth = 31;
  constexpr int kHeight = 25;
  std::vector<float> point(kWidth * kHeight, 0.0F);
  point[12 * kWidth + 15] = 1.0F;
  const LightMoments m =
      moments_of(lens_blurred(point, kWidth, kHeight, sigma_px), kWidth, {15, 12});
  CHECK(m.mass == Approx(1.0).epsilon(1e-5));
  // The kernel ends at three deviations: its variance is up to 3 % short.
  CHECK(m.spread(0, 0) == Approx(sigma_px * sigma_px).epsilon(0.03));
  CHECK(m.spread(1, 1) == Approx(m.spread(0, 0)).epsilon(1e-4));

  const std::vector<float> flat(kWidth * kHeight, 0.75F);
  for (const float value : lens_blurred(flat, kWidth, kHeight, sigma_px))
    CHECK(value == Approx(0.75F).epsilon(1e-5));
  CHECK(lens_blurred(point, kWidth, kHeight, 0.0) == point);
}

TEST_CASE("Image motion equals that of projected points", "[simulation][sensor]") {
  const Camera camera = distorted_camera(188, 120, 115.0);
  const PixelRays rays(camera);
  Vector6 velocity;
  velocity << 0.4, -0.9, 0.6, 1.5, -0.7, 0.3;
  const double depth = GENERATE(0.7, 4.0, 0.0);
  CAPTURE(depth);
  const std::vector<float> depths(188 * 120, static_cast<float>(depth));
  const std::vector<Eigen::Vector2f> motion = image_motion(rays, depths, velocity, 0.01);
  for (const Eigen::Vector2i& pixel : {Eigen::Vector2i(5, 9), {94, 60}, {180, 30}, {100, 112}}) {
    const double z = depth > 0.0 ? depth : 1e6;
    const Eigen::Vector3d point = z * camera.unproject(pixel.cast<double>()).value().homogeneous();
    const auto seen_at = [&](double t) {
      const SE3 T_start_body = se3_exp(t * velocity);
      const SE3 T_cam_start = (T_start_body * camera.T_body_cam).inverse() * camera.T_body_cam;
      return camera.project((T_cam_start * point).hnormalized()).value();
    };
    const Eigen::Vector2d expected = seen_at(0.005) - seen_at(-0.005);
    const std::size_t i = static_cast<std::size_t>(pixel.y() * 188 + pixel.x());
    CAPTURE(pixel.transpose(), expected.transpose());
    // A finite difference of the lens stands in for its derivative: 1 % near the corners.
    CHECK((motion[i].cast<double>() - expected).norm() < 0.02 * expected.norm() + 1e-3);
  }
}

TEST_CASE("A bright point is smeared along its motion, its light kept", "[simulation][sensor]") {
  constexpr int kWidth = 61;
  constexpr int kHeight = 41;
  std::vector<float> image(kWidth * kHeight, 0.0F);
  image[20 * kWidth + 30] = 1.0F;
  const Eigen::Vector2f motion(9.0F, 6.0F);
  const std::vector<float> result =
      blurred(image, kWidth, kHeight, std::vector<Eigen::Vector2f>(image.size(), motion));
  const auto [mass, mean, spread] = moments_of(result, kWidth, {30, 20});
  CHECK(mass == Approx(1.0).margin(0.02));
  CHECK(mean.norm() < 0.01);
  // A segment of length L has the variance L^2 / 12 along it; bilinear taps add about 1/6 px^2.
  const Eigen::Vector2d along = motion.cast<double>().normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  CHECK(along.dot(spread * along) == Approx(motion.squaredNorm() / 12.0 + 0.17).epsilon(0.1));
  CHECK(across.dot(spread * across) < 0.3);
}

TEST_CASE("Views without the data that an effect needs are refused", "[simulation][sensor]") {
  const Camera camera = forward_camera(8, 8, 8.0);
  const SensorEffects effects(PixelRays(camera), {});
  RenderedView view = flat_view(camera, 0.5F);
  view.depth_m.clear();
  CHECK_THROWS_AS(effects.gray(view, shot(1.0)), std::invalid_argument);
  CHECK(effects.request(false).depth);
  CHECK_THROWS_AS(effects.gray(flat_view(forward_camera(4, 8, 8.0), 0.5F), shot(1.0)),
                  std::invalid_argument);
  SensorEffectsConfig config;
  config.gamma = 0.1;
  CHECK_THROWS_AS(SensorEffects(PixelRays(camera), config), ConfigError);
}

}  // namespace
}  // namespace km
