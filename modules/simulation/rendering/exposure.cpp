#include "modules/simulation/rendering/exposure.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

// Mean grey level, as a share of saturation, of the scene under a gain.
double mean_level(const std::vector<float>& radiance, double gain, double gamma) {
  double sum = 0.0;
  for (const float value : radiance)
    sum += std::pow(std::clamp(gain * static_cast<double>(value), 0.0, 1.0), 1.0 / gamma);
  return sum / static_cast<double>(radiance.size());
}

// A camera in a cellar, or one that looks at nothing, stops somewhere.
constexpr double kLeastGain = 1e-3;
constexpr double kMostGain = 1e3;

// The gain that gives the target; the mean level grows with it.
double solve_gain(const std::vector<float>& radiance, const SensorEffectsConfig& config) {
  double low = std::log(kLeastGain);
  double high = std::log(kMostGain);
  constexpr int kHalvings = 30;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const bool dark = mean_level(radiance, std::exp(middle), config.gamma) < config.target_level;
    (dark ? low : high) = middle;
  }
  return std::exp(0.5 * (low + high));
}

}  // namespace

ExposureControl::ExposureControl(const SensorEffectsConfig& config, double rate_hz)
    : config_(checked(config)) {
  if (!(rate_hz > 0.0) || !std::isfinite(rate_hz))
    throw std::invalid_argument("ExposureControl: a rate of " + std::to_string(rate_hz) + " Hz");
  constexpr double kConfiguredRate_hz = 20.0;
  share_per_frame_ = 1.0 - std::pow(1.0 - config_.adaptation, kConfiguredRate_hz / rate_hz);
}

Exposure ExposureControl::next(const RenderedView& scene) {
  if (scene.radiance.empty())
    throw std::invalid_argument("ExposureControl: a view without radiance");
  if (!started_) {
    log_gain_ = std::log(solve_gain(scene.radiance, config_));
    started_ = true;
  } else {
    // A step of the integrating controller that steers the mean of a linear image to its target.
    const double level = mean_level(scene.radiance, std::exp(log_gain_), config_.gamma);
    const double error = std::log(config_.target_level / std::max(level, 1e-3));
    log_gain_ = std::clamp(log_gain_ + share_per_frame_ * config_.gamma * error,
                           std::log(kLeastGain), std::log(kMostGain));
  }
  Exposure exposure;
  exposure.gain = std::exp(log_gain_);
  exposure.time_s = std::min(exposure.gain * config_.unit_exposure_s, config_.max_exposure_s);
  return exposure;
}

}  // namespace km
