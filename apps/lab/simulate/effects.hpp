#pragma once

#include <string>
#include <vector>

#include "apps/lab/simulation/motion/sensor_errors.hpp"
#include "apps/lab/simulation/motion/traffic.hpp"
#include "apps/lab/simulation/rendering/sensor_effects_config.hpp"
#include "modules/core/config.hpp"

namespace km {

/// Places that mislead place recognition.
struct PlacesConfig {
  static constexpr const char* kSection = "places";

  bool opposite = false;

  void visit_fields(auto& visitor) {
    visitor.field("opposite", opposite,
                  "every second robot drives the route of the robot before it the other way round");
  }
};

/// Everything that makes a recording harder than a calm, exact world.
struct Effects {
  SensorEffectsConfig sensor{.motion_blur = false};
  InertialErrorConfig inertial;
  CalibrationErrorConfig calibration_error;
  TimingErrorConfig timing;
  TrafficConfig traffic;
  PlacesConfig places;
};

inline constexpr int kHardestLevel = 3;

/// Effects of a level of difficulty, from 0 to kHardestLevel, with single keys "section.key=value"
/// over it. Throws ConfigError that lists all problems.
[[nodiscard]] Effects load_effects(int level, const std::vector<std::string>& settings);

}  // namespace km
