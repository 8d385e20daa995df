#include "modules/simulation/rendering/sensor_effects.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

#include "modules/simulation/rendering/lens_blur.hpp"
#include "modules/simulation/rendering/motion_blur.hpp"

namespace km {
namespace {

constexpr int kTile = 512;  // edge of the noise tile, a power of two
constexpr std::uint32_t kTileMask = kTile - 1;

// Convolves each row of a periodic square with a Gaussian and transposes it: twice does both axes.
std::vector<float> smoothed_transposed(const std::vector<float>& field, double sigma_px) {
  const int radius = static_cast<int>(std::ceil(3.0 * sigma_px));
  std::vector<float> kernel;
  for (int i = -radius; i <= radius; ++i)
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
  std::vector<float> result(field.size());
  for (int y = 0; y < kTile; ++y) {
    for (int x = 0; x < kTile; ++x) {
      float sum = 0.0F;
      for (int i = -radius; i <= radius; ++i)
        sum += kernel[static_cast<std::size_t>(i + radius)] *
               field[static_cast<std::size_t>(y * kTile + ((x + i) & (kTile - 1)))];
      result[static_cast<std::size_t>(x * kTile + y)] = sum;
    }
  }
  return result;
}

// Gaussian noise of unit variance that repeats, neighbours correlated over `sigma_px`.
std::vector<float> make_noise_tile(double sigma_px) {
  std::mt19937 random(20240229);  // any: each image takes the tile from elsewhere
  std::normal_distribution<float> normal;
  std::vector<float> tile(static_cast<std::size_t>(kTile) * kTile);
  for (float& value : tile) value = normal(random);
  constexpr double kWhite_px = 0.1;
  if (sigma_px > kWhite_px)
    tile = smoothed_transposed(smoothed_transposed(tile, sigma_px), sigma_px);
  double squares = 0.0;
  for (const float value : tile) squares += static_cast<double>(value) * static_cast<double>(value);
  const auto scale = static_cast<float>(std::sqrt(static_cast<double>(tile.size()) / squares));
  for (float& value : tile) value *= scale;
  return tile;
}

// What one shot has in common for all its pixels.
struct NoiseLevels {
  float read_variance = 0.0F;    // in shares of saturation
  float photon_variance = 0.0F;  // at saturation
};

NoiseLevels noise_levels(const SensorEffectsConfig& config, const Exposure& exposure) {
  // Beyond the longest shutter time the signal is amplified, and what noise it has.
  const double opened = exposure.time_s / config.unit_exposure_s;
  const double amplified = opened > 0.0 ? std::max(1.0, exposure.gain / opened) : 1.0;
  const double read = amplified * config.read_noise / 255.0;
  const double photon = config.photon_noise / 255.0;
  return {static_cast<float>(read * read), static_cast<float>(amplified * photon * photon)};
}

// Where in the noise tile an image begins; two places are added.
struct TileOffsets {
  std::array<std::uint32_t, 2> x;
  std::array<std::uint32_t, 2> y;
};

TileOffsets draw_offsets(std::mt19937& random) {
  TileOffsets offsets;
  for (std::size_t i = 0; i < 2; ++i) {
    offsets.x[i] = static_cast<std::uint32_t>(random()) & kTileMask;
    offsets.y[i] = static_cast<std::uint32_t>(random()) & kTileMask;
  }
  return offsets;
}

std::mt19937 generator(std::uint64_t seed) {
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  return std::mt19937(sequence);
}

}  // namespace

SensorEffects::SensorEffects(const PixelRays& rays, const SensorEffectsConfig& config)
    : config_(checked(config)),
      rays_(rays),
      noise_tile_(make_noise_tile(config.noise_correlation_px)) {
  const PinholeCamera& camera = rays.camera();
  // The light falls as the fourth power of a cosine does: 1 / (1 + k r^2)^2.
  const Eigen::Vector2d half(0.5 * (camera.width - 1), 0.5 * (camera.height - 1));
  const double k =
      (1.0 / std::sqrt(1.0 - config_.vignetting) - 1.0) / std::max(half.squaredNorm(), 1.0);
  relative_light_.reserve(static_cast<std::size_t>(camera.width) *
                          static_cast<std::size_t>(camera.height));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double fall = 1.0 + k * (Eigen::Vector2d(x, y) - half).squaredNorm();
      relative_light_.push_back(static_cast<float>(1.0 / (fall * fall)));
    }
  }
  // The response, over the square root of the signal: fine steps in the dark, where it is steep.
  for (int i = 0; i <= kResponseSteps; ++i)
    response_.push_back(static_cast<float>(
        255.0 * std::pow(static_cast<double>(i) / kResponseSteps, 2.0 / config_.gamma)));
}

RenderRequest SensorEffects::request(bool color) const {
  RenderRequest request;
  request.radiance = !color;
  request.rgb = color;
  request.depth = config_.motion_blur;
  return request;
}

void SensorEffects::require_complete(const RenderedView& view, std::size_t values) const {
  const PinholeCamera& camera = rays_.camera();
  if (view.width != camera.width || view.height != camera.height)
    throw std::invalid_argument("SensorEffects: a view of " + std::to_string(view.width) + " x " +
                                std::to_string(view.height) + " for a camera of " +
                                std::to_string(camera.width) + " x " +
                                std::to_string(camera.height));
  if (values != relative_light_.size())
    throw std::invalid_argument("SensorEffects: the view lacks the radiance or colour asked for");
  if (config_.motion_blur && view.depth_m.size() != relative_light_.size())
    throw std::invalid_argument("SensorEffects: motion blur needs the view's depth");
}

template <typename Value>
std::vector<Value> SensorEffects::on_sensor(const std::vector<Value>& image,
                                            const RenderedView& view, const Shot& shot) const {
  const std::vector<Value> seen =
      lens_blurred(image, view.width, view.height, config_.lens_blur_px);
  if (!config_.motion_blur || shot.body_velocity.isZero() || !(shot.exposure.time_s > 0.0))
    return seen;
  return blurred(seen, view.width, view.height,
                 image_motion(rays_, view.depth_m, shot.body_velocity, shot.exposure.time_s));
}

std::uint8_t SensorEffects::quantized(float signal) const {
  const float position =
      std::sqrt(std::clamp(signal, 0.0F, 1.0F)) * static_cast<float>(kResponseSteps);
  const int step = std::min(static_cast<int>(position), kResponseSteps - 1);
  const float* entry = response_.data() + step;
  const float level = entry[0] + (position - static_cast<float>(step)) * (entry[1] - entry[0]);
  return static_cast<std::uint8_t>(level + 0.5F);
}

// Exposure, noise, response of every `stride`-th value of `linear`; noise differs per channel.
void SensorEffects::expose(const float* linear, std::size_t stride, const Shot& shot,
                           std::mt19937& random, std::uint8_t* levels) const {
  const NoiseLevels noise = noise_levels(config_, shot.exposure);
  const TileOffsets offsets = draw_offsets(random);
  const auto gain = static_cast<float>(shot.exposure.gain);
  const auto width = static_cast<std::uint32_t>(rays_.camera().width);
  const auto height = static_cast<std::uint32_t>(rays_.camera().height);
  std::size_t i = 0;
  for (std::uint32_t y = 0; y < height; ++y) {
    const float* row0 = noise_tile_.data() + ((y + offsets.y[0]) & kTileMask) * kTile;
    const float* row1 = noise_tile_.data() + ((y + offsets.y[1]) & kTileMask) * kTile;
    for (std::uint32_t x = 0; x < width; ++x, ++i) {
      constexpr float kHalfRoot = 0.70710678F;  // the sum of two has unit variance again
      const float draw =
          kHalfRoot * (row0[(x + offsets.x[0]) & kTileMask] + row1[(x + offsets.x[1]) & kTileMask]);
      const float signal = gain * relative_light_[i] * linear[i * stride];
      const float variance =
          noise.read_variance + noise.photon_variance * std::clamp(signal, 0.0F, 1.0F);
      levels[i * stride] = quantized(signal + draw * std::sqrt(variance));
    }
  }
}

GrayImage SensorEffects::gray(const RenderedView& view, const Shot& shot) const {
  require_complete(view, view.radiance.size());
  const std::vector<float> linear = on_sensor(view.radiance, view, shot);
  std::mt19937 random = generator(shot.noise_seed);
  GrayImage image{view.width, view.height, std::vector<std::uint8_t>(linear.size())};
  expose(linear.data(), 1, shot, random, image.pixels.data());
  return image;
}

ColorImage SensorEffects::color(const RenderedView& view, const Shot& shot) const {
  require_complete(view, view.rgb.size());
  const std::vector<Eigen::Vector3f> linear = on_sensor(view.rgb, view, shot);
  std::mt19937 random = generator(shot.noise_seed);
  ColorImage image{view.width, view.height, std::vector<std::uint8_t>(3 * linear.size())};
  for (std::size_t channel = 0; channel < 3; ++channel)
    expose(linear.data()->data() + channel, 3, shot, random, image.pixels.data() + channel);
  return image;
}

}  // namespace km
