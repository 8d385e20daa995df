#include "apps/lab/simulate/effects.hpp"

#include <array>

#include "runtime/config_layers.hpp"

namespace km {
namespace {

// A key "section.key" and its value at each level of difficulty.
struct LevelKey {
  const char* key;
  std::array<const char*, kHardestLevel + 1> values;
};

// Level 0: exact sensors in calm light. 1: mild. 2: a usual robot. 3: hard.
constexpr LevelKey kLevels[] = {
    {"sensor.motion_blur", {"false", "true", "true", "true"}},
    {"sensor.unit_exposure_s", {"0.005", "0.005", "0.005", "0.01"}},
    {"sensor.max_exposure_s", {"0.015", "0.015", "0.015", "0.025"}},
    {"sensor.rolling_shutter_s", {"0", "0.005", "0.015", "0.025"}},
    {"sensor.passage_light", {"1", "1.5", "3", "6"}},
    {"sensor.passage_every_s", {"0", "40", "20", "12"}},
    {"sensor.glare", {"0", "0.05", "0.15", "0.3"}},
    {"sensor.dirt", {"0", "0.1", "0.25", "0.5"}},
    {"sensor.dirt_spots", {"20", "5", "10", "20"}},
    {"sensor.rain_drops", {"0", "0", "0", "1500"}},
    {"inertial.gyro_scale", {"0", "0.001", "0.003", "0.01"}},
    {"inertial.accel_scale", {"0", "0.001", "0.005", "0.01"}},
    {"inertial.misalignment_rad", {"0", "0.0005", "0.002", "0.005"}},
    {"inertial.vibration_gyro_rps", {"0", "0.005", "0.02", "0.05"}},
    {"inertial.vibration_accel_mps2", {"0", "0.05", "0.3", "1"}},
    {"inertial.vibration_hz", {"37", "37", "37", "71"}},
    {"inertial.warm_gyro_rps", {"0", "0.0005", "0.002", "0.005"}},
    {"inertial.warm_accel_mps2", {"0", "0.005", "0.02", "0.05"}},
    {"calibration_error.focal_share", {"0", "0.001", "0.002", "0.005"}},
    {"calibration_error.mounting_rad", {"0", "0.001", "0.003", "0.0087"}},
    {"calibration_error.stereo_rad", {"0", "0", "0.0002", "0.0005"}},
    {"timing.drift_ppm", {"0", "5", "20", "50"}},
    {"timing.jump_s", {"0", "0", "0", "0.02"}},
    {"timing.jump_every_s", {"0", "0", "0", "20"}},
    {"timing.camera_drift_ppm", {"0", "0", "0", "20"}},
    {"timing.camera_delay_s", {"0", "0.0005", "0.002", "0.005"}},
    {"timing.dropped_share", {"0", "0.005", "0.02", "0.05"}},
    {"timing.dropped_run", {"1", "1", "1.5", "2"}},
    {"traffic.cars", {"0", "4", "10", "16"}},
    {"traffic.people", {"0", "4", "12", "24"}},
    {"places.opposite", {"false", "false", "false", "true"}},
};

}  // namespace

Effects load_effects(int level, const std::vector<std::string>& settings) {
  ConfigLayers all;
  for (const LevelKey& key : kLevels)
    all.add_override(std::string(key.key) + '=' + key.values.at(static_cast<std::size_t>(level)));
  for (const std::string& setting : settings) all.add_override(setting);
  Effects effects{.sensor = all.load<SensorEffectsConfig>(),
                  .inertial = all.load<InertialErrorConfig>(),
                  .calibration_error = all.load<CalibrationErrorConfig>(),
                  .timing = all.load<TimingErrorConfig>(),
                  .traffic = all.load<TrafficConfig>(),
                  .places = all.load<PlacesConfig>()};
  all.finish();
  return effects;
}

}  // namespace km
