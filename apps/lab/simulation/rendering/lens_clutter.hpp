#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/rendering/sensor_effects_config.hpp"
#include "apps/lab/simulation/rendering/shot.hpp"
#include "modules/core/camera/camera.hpp"

namespace km {

/// Clutter between a scene and the sensor: falling rain, dirt on the lens, and light that the lens
/// scatters. Immutable; one per camera.
class LensClutter {
 public:
  /// `seed` determines the spots of dirt.
  LensClutter(const Camera& camera, const SensorEffectsConfig& config, std::uint64_t seed);

  /// Adds the clutter to the light on the sensor, row-major.
  void add_to(std::vector<float>& light, const Shot& shot) const;

 private:
  void cover_with_dirt(const SensorEffectsConfig& config, std::uint64_t seed);
  [[nodiscard]] std::vector<float> rain_cover(const Shot& shot) const;
  [[nodiscard]] std::vector<float> veil(const Shot& shot) const;

  Camera camera_;
  double glare_ = 0.0;
  int rain_drops_ = 0;
  std::vector<float> dirt_;  // share of light that is hidden; empty: a clean lens
};

}  // namespace km
