#pragma once

#include <yaml-cpp/yaml.h>

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "apps/lab/simulation/motion/inertial_errors.hpp"
#include "apps/lab/simulation/motion/robot_clock.hpp"
#include "apps/lab/simulation/motion/told_calibration.hpp"
#include "apps/lab/simulation/motion/traffic.hpp"
#include "apps/lab/simulation/rendering/sensor_effects_config.hpp"
#include "apps/lab/simulation/world/places.hpp"

namespace km {

/// Everything that makes a recording harder than a calm, exact world.
struct Effects {
  SensorEffectsConfig sensor{.motion_blur = false};
  InertialErrorConfig inertial;
  CalibrationErrorConfig calibration_error;
  TimingErrorConfig timing;
  TrafficConfig traffic;
  PlacesConfig places;
};

inline constexpr int kHardestLevel = 4;

/// A key of the effects, and its value at each level of difficulty.
struct LevelKey {
  const char* key;  ///< "section.key"
  std::array<const char*, kHardestLevel + 1> values;
};

/// All keys that depend on the level. The other keys have the defaults of their sections.
[[nodiscard]] std::span<const LevelKey> level_table();

/// Layers that the effects consist of; later ones replace keys of earlier ones.
struct EffectLayers {
  int level = 0;
  std::string file = {};                            ///< File of options, for messages.
  std::map<std::string, YAML::Node> sections = {};  ///< Its maps, by name.
  std::vector<std::string> settings = {};           ///< "section.key=value"
};

/// Throws ConfigError that lists all problems.
[[nodiscard]] Effects load_effects(const EffectLayers& layers);

/// All keys "section.key" with their values.
[[nodiscard]] std::map<std::string, std::string> key_texts(Effects effects);

/// The keys whose values differ from those of `level`.
[[nodiscard]] std::map<std::string, std::string> changed_keys(const Effects& effects, int level);

}  // namespace km
