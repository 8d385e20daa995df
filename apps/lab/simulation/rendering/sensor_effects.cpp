#include "apps/lab/simulation/rendering/sensor_effects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

constexpr double kVignetting = 0.2;  // share of light lost in the corners
// Standard deviation of a point. With this value the Vicon room has the same variance of the
// Laplacian as recorded images.
constexpr double kLensBlur_px = 0.6;
constexpr double kReadNoise = 1.0;    // [grey levels], in the dark
constexpr double kPhotonNoise = 2.0;  // [grey levels], just below saturation
constexpr double kNoiseCorrelation_px =
    1.2;                               // demosaicing, filters and JPEG leave little fine noise
constexpr double kTargetLevel = 0.55;  // mean grey, share of saturation
constexpr double kAdaptation = 0.02;   // share of the way to the target per frame, in log exposure
constexpr double kAdaptationRate_hz = 20.0;

// Mean grey level, as a share of saturation, of the scene under a gain.
double mean_level(const std::vector<float>& radiance, double gain) {
  double sum = 0.0;
  for (const float value : radiance) sum += std::clamp(gain * static_cast<double>(value), 0.0, 1.0);
  return sum / static_cast<double>(radiance.size());
}

// Bounds for a camera in the dark, or one that sees nothing.
constexpr double kLeastGain = 1e-3;
constexpr double kMostGain = 1e3;

// The gain for the target level; the mean level grows with the gain.
double solve_gain(const std::vector<float>& radiance) {
  double low = std::log(kLeastGain);
  double high = std::log(kMostGain);
  constexpr int kHalvings = 30;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const bool dark = mean_level(radiance, std::exp(middle)) < kTargetLevel;
    (dark ? low : high) = middle;
  }
  return std::exp(0.5 * (low + high));
}

// Weights of a Gaussian out to three standard deviations, 1 in the middle.
std::vector<float> gaussian_kernel(double sigma_px) {
  const int radius = static_cast<int>(std::ceil(3.0 * sigma_px));
  std::vector<float> kernel;
  for (int i = -radius; i <= radius; ++i)
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
  return kernel;
}

/// `row` convolved; `padded` is scratch memory.
void blur_row(const std::vector<float>& kernel, const float* row, std::size_t n,
              std::vector<float>& padded, float* result) {
  const std::size_t radius = kernel.size() / 2;
  padded.assign(radius, row[0]);
  padded.insert(padded.end(), row, row + n);
  padded.insert(padded.end(), radius, row[n - 1]);
  for (std::size_t x = 0; x < n; ++x) result[x] = kernel[0] * padded[x];
  for (std::size_t i = 1; i < kernel.size(); ++i)
    for (std::size_t x = 0; x < n; ++x) result[x] += kernel[i] * padded[x + i];
}

// Velocities of the camera in its own frame.
struct CameraVelocity {
  Eigen::Vector3f angular;
  Eigen::Vector3f linear;
};

CameraVelocity camera_velocity(const SE3& T_body_cam, const Vector6& body_velocity) {
  const Eigen::Vector3d omega = body_velocity.head<3>();
  const Eigen::Vector3d at_camera = body_velocity.tail<3>() + omega.cross(T_body_cam.translation());
  const Eigen::Matrix3d R_cam_body = T_body_cam.linear().transpose();
  return {(R_cam_body * omega).cast<float>(), (R_cam_body * at_camera).cast<float>()};
}

float bilinear(const std::vector<float>& image, int width, int height, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(width - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(height - 1));
  const int column = std::min(static_cast<int>(x), std::max(width - 2, 0));
  const int row = std::min(static_cast<int>(y), std::max(height - 2, 0));
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const float* p = image.data() + static_cast<std::ptrdiff_t>(row) * width + column;
  const std::ptrdiff_t right = width > 1 ? 1 : 0;
  const std::ptrdiff_t down = height > 1 ? width : 0;
  const float low = p[0] + fx * (p[right] - p[0]);
  const float high = p[down] + fx * (p[down + right] - p[down]);
  return low + fy * (high - low);
}

constexpr int kTile = 512;  // edge of the noise tile, a power of two
constexpr std::uint32_t kTileMask = kTile - 1;

// Convolves each row of a periodic square with a Gaussian and transposes it: twice does both axes.
std::vector<float> smoothed_transposed(const std::vector<float>& field, double sigma_px) {
  const std::vector<float> kernel = gaussian_kernel(sigma_px);
  const int radius = static_cast<int>(kernel.size() / 2);
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

// Gaussian noise of unit variance that repeats, neighbours correlated.
std::vector<float> make_noise_tile() {
  // A constant seed is enough, because each image uses another part of the tile.
  std::mt19937 random(20240229);
  std::normal_distribution<float> normal;
  std::vector<float> tile(static_cast<std::size_t>(kTile) * kTile);
  for (float& value : tile) value = normal(random);
  tile = smoothed_transposed(smoothed_transposed(tile, kNoiseCorrelation_px), kNoiseCorrelation_px);
  double squares = 0.0;
  for (const float value : tile) squares += static_cast<double>(value) * static_cast<double>(value);
  const auto scale = static_cast<float>(std::sqrt(static_cast<double>(tile.size()) / squares));
  for (float& value : tile) value *= scale;
  return tile;
}

// Noise levels common to all pixels of one shot.
struct NoiseLevels {
  float read_variance = 0.0F;    // variance in the dark; saturation is 1
  float photon_variance = 0.0F;  // additional variance at saturation
};

NoiseLevels noise_levels(const SensorEffectsConfig& config, const Exposure& exposure) {
  // Beyond the longest shutter time the signal is amplified together with its noise.
  const double opened = exposure.time_s / config.unit_exposure_s;
  const double amplified = opened > 0.0 ? std::max(1.0, exposure.gain / opened) : 1.0;
  const double read = amplified * kReadNoise / 255.0;
  const double photon = kPhotonNoise / 255.0;
  return {static_cast<float>(read * read), static_cast<float>(amplified * photon * photon)};
}

// Begin of an image in the noise tile; the noise at two places is added.
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

ExposureControl::ExposureControl(const SensorEffectsConfig& config, double rate_hz)
    : config_(checked(config)) {
  share_per_frame_ = 1.0 - std::pow(1.0 - kAdaptation, kAdaptationRate_hz / rate_hz);
}

Exposure ExposureControl::next(const RenderedView& scene, double light) {
  if (!started_) {
    log_gain_ = std::log(solve_gain(scene.radiance) / light);
    started_ = true;
  } else {
    // A step of the integrating controller that steers the mean of a linear image to its target.
    const double level = mean_level(scene.radiance, light * std::exp(log_gain_));
    const double error = std::log(kTargetLevel / std::max(level, 1e-3));
    log_gain_ =
        std::clamp(log_gain_ + share_per_frame_ * error, std::log(kLeastGain), std::log(kMostGain));
  }
  Exposure exposure;
  exposure.gain = std::exp(log_gain_);
  exposure.time_s = std::min(exposure.gain * config_.unit_exposure_s, config_.max_exposure_s);
  return exposure;
}

LightPassages::LightPassages(const SensorEffectsConfig& config, double duration_s,
                             std::uint64_t seed) {
  checked(config);
  if (!(config.passage_every_s > 0.0) || config.passage_light == 1.0) return;
  SeededRandom random(seed);
  for (double at = 0.0;;) {
    // Intervals from half to one and a half of the mean; a passage ends before the next begins.
    at = std::max(at + config.passage_every_s * (0.5 + random.unit()),
                  passages_.empty() ? 0.0 : passages_.back().end_s);
    if (at > duration_s) return;
    const double sign = random.chance(0.5) ? 1.0 : -1.0;
    passages_.push_back({at, at + config.passage_s, sign * std::log(config.passage_light)});
  }
}

double LightPassages::factor(double t_s) const {
  for (const Passage& passage : passages_) {
    if (t_s < passage.begin_s || t_s > passage.end_s) continue;
    const double inside_s = std::min(t_s - passage.begin_s, passage.end_s - t_s);
    return std::exp(passage.log_light * std::min(1.0, inside_s / kRamp_s));
  }
  return 1.0;
}

std::vector<float> lens_blurred(const std::vector<float>& image, int width, int height) {
  std::vector<float> kernel = gaussian_kernel(kLensBlur_px);
  const float sum = std::accumulate(kernel.begin(), kernel.end(), 0.0F);
  for (float& weight : kernel) weight /= sum;
  const auto n = static_cast<std::size_t>(width);
  const int radius = static_cast<int>(kernel.size() / 2);
  std::vector<float> across(image.size());
  std::vector<float> padded;
  for (std::size_t begin = 0; begin < image.size(); begin += n)
    blur_row(kernel, image.data() + begin, n, padded, across.data() + begin);
  std::vector<float> result(image.size());
  for (int y = 0; y < height; ++y) {
    float* const out = result.data() + static_cast<std::size_t>(y) * n;
    for (int i = -radius; i <= radius; ++i) {
      const auto row = static_cast<std::size_t>(std::clamp(y + i, 0, height - 1));
      const float weight = kernel[static_cast<std::size_t>(i + radius)];
      const float* const in = across.data() + row * n;
      if (i == -radius)
        for (std::size_t x = 0; x < n; ++x) out[x] = weight * in[x];
      else
        for (std::size_t x = 0; x < n; ++x) out[x] += weight * in[x];
    }
  }
  return result;
}

std::vector<Eigen::Vector2f> image_motion(const PixelRays& rays, const std::vector<float>& depth_m,
                                          const Vector6& body_velocity, double time_s) {
  const Camera& camera = rays.camera();
  const auto [omega, v] = camera_velocity(camera.T_body_cam, body_velocity);
  const auto time = static_cast<float>(time_s);
  std::vector<Eigen::Vector2f> motion(depth_m.size());
  std::size_t i = 0;
  for (int y = 0; y < camera.height; ++y) {
    const Eigen::Vector2f* bearing =
        rays.bearings().data() + static_cast<std::ptrdiff_t>(y) * rays.stride();
    for (int x = 0; x < camera.width; ++x, ++i, ++bearing) {
      motion[i].setZero();
      if (!rays.is_lit(i)) continue;
      const Eigen::Vector2f& b = *bearing;
      const float inverse_depth = depth_m[i] > 0.0F ? 1.0F / depth_m[i] : 0.0F;
      // Motion of the point at unit depth, then of its bearing.
      const float px = -(omega.y() - omega.z() * b.y() + v.x() * inverse_depth);
      const float py = -(omega.z() * b.x() - omega.x() + v.y() * inverse_depth);
      const float pz = -(omega.x() * b.y() - omega.y() * b.x() + v.z() * inverse_depth);
      const float bx = px - b.x() * pz;
      const float by = py - b.y() * pz;
      // Pixels per bearing: the inverse of the change of the bearing from pixel to pixel.
      const Eigen::Vector2f right = bearing[1] - b;
      const Eigen::Vector2f down = bearing[rays.stride()] - b;
      const float scale = time / (right.x() * down.y() - right.y() * down.x());
      motion[i] = {scale * (down.y() * bx - down.x() * by),
                   scale * (right.x() * by - right.y() * bx)};
    }
  }
  return motion;
}

std::vector<float> blurred(const std::vector<float>& image, int width, int height,
                           const std::vector<Eigen::Vector2f>& motion) {
  std::vector<float> result(image.size());
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      constexpr float kStill_px = 0.2F;  // below this the blur is smaller than a pixel
      constexpr float kMostTaps = 64.0F;
      const float length = motion[i].norm();
      if (!(length > kStill_px)) {
        result[i] = image[i];
        continue;
      }
      const auto taps = static_cast<int>(std::min(std::ceil(length) + 1.0F, kMostTaps));
      const Eigen::Vector2f step = motion[i] / static_cast<float>(taps);
      const float first = -0.5F * static_cast<float>(taps - 1);
      float sum = 0.0F * image[i];
      for (int k = 0; k < taps; ++k) {
        const float along = first + static_cast<float>(k);
        sum += bilinear(image, width, height, static_cast<float>(x) + along * step.x(),
                        static_cast<float>(y) + along * step.y());
      }
      result[i] = sum / static_cast<float>(taps);
    }
  }
  return result;
}

SensorEffects::SensorEffects(const PixelRays& rays, const SensorEffectsConfig& config,
                             std::uint64_t dirt_seed)
    : config_(checked(config)),
      rays_(rays),
      clutter_(rays.camera(), config, dirt_seed),
      noise_tile_(make_noise_tile()) {
  const Camera& camera = rays.camera();
  // The light falls with the fourth power of a cosine: 1 / (1 + k r^2)^2.
  const Eigen::Vector2d half(0.5 * (camera.width - 1), 0.5 * (camera.height - 1));
  const double k = (1.0 / std::sqrt(1.0 - kVignetting) - 1.0) / std::max(half.squaredNorm(), 1.0);
  relative_light_.reserve(static_cast<std::size_t>(camera.width) *
                          static_cast<std::size_t>(camera.height));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double fall = 1.0 + k * (Eigen::Vector2d(x, y) - half).squaredNorm();
      relative_light_.push_back(static_cast<float>(1.0 / (fall * fall)));
    }
  }
  // The response as a function of the square root of the signal: fine steps in the dark.
  for (int i = 0; i <= kResponseSteps; ++i)
    response_.push_back(
        static_cast<float>(255.0 * std::pow(static_cast<double>(i) / kResponseSteps, 2.0)));
}

RenderRequest SensorEffects::request() const {
  return {.radiance = true, .depth = config_.motion_blur, .labels = false};
}

std::vector<float> SensorEffects::on_sensor(const RenderedView& view, const Shot& shot) const {
  std::vector<float> seen = lens_blurred(view.radiance, view.width, view.height);
  if (config_.motion_blur && !shot.body_velocity.isZero() && shot.exposure.time_s > 0.0)
    seen = blurred(seen, view.width, view.height,
                   image_motion(rays_, view.depth_m, shot.body_velocity, shot.exposure.time_s));
  clutter_.add_to(seen, shot);
  return seen;
}

std::uint8_t SensorEffects::quantized(float signal) const {
  const float position =
      std::sqrt(std::clamp(signal, 0.0F, 1.0F)) * static_cast<float>(kResponseSteps);
  const int step = std::min(static_cast<int>(position), kResponseSteps - 1);
  const float* entry = response_.data() + step;
  const float level = entry[0] + (position - static_cast<float>(step)) * (entry[1] - entry[0]);
  return static_cast<std::uint8_t>(level + 0.5F);
}

GrayImage SensorEffects::gray(const RenderedView& view, const Shot& shot) const {
  const std::vector<float> linear = on_sensor(view, shot);
  std::mt19937 random = generator(shot.noise_seed);
  GrayImage image{view.width, view.height, std::vector<std::uint8_t>(linear.size())};
  const NoiseLevels noise = noise_levels(config_, shot.exposure);
  const TileOffsets offsets = draw_offsets(random);
  const auto gain = static_cast<float>(shot.exposure.gain * shot.light);
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
      const float signal = gain * relative_light_[i] * linear[i];
      const float variance =
          noise.read_variance + noise.photon_variance * std::clamp(signal, 0.0F, 1.0F);
      image.pixels[i] = quantized(signal + draw * std::sqrt(variance));
    }
  }
  return image;
}

}  // namespace km
