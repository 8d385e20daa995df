#pragma once

#include <cstdint>
#include <vector>

#include "apps/lab/simulation/rendering/sensor_effects_config.hpp"

namespace km {

/// Passages of a robot through dark and bright places: a factor of all light over time. Each
/// passage is dark or bright by chance. Its light comes and goes within kRamp_s, evenly in its
/// logarithm. Immutable.
class LightPassages {
 public:
  static constexpr double kRamp_s = 0.4;

  /// Passages within `duration_s`. Throws ConfigError.
  LightPassages(const SensorEffectsConfig& config, double duration_s, std::uint64_t seed);

  /// Factor at `t_s`; 1 outside all passages.
  [[nodiscard]] double factor(double t_s) const;

 private:
  struct Passage {
    double begin_s = 0.0, end_s = 0.0;
    double log_light = 0.0;
  };
  std::vector<Passage> passages_;  // ascending, without overlap
};

}  // namespace km
