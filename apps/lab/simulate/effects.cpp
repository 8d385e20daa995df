#include "apps/lab/simulate/effects.hpp"

#include <algorithm>

#include "runtime/config_layers.hpp"

namespace km {
namespace {

// Level 0: exact sensors in calm light. 1: mild. 2: a usual robot. 3: hard. 4: the worst.
constexpr LevelKey kLevels[] = {
    {"sensor.motion_blur", {"false", "true", "true", "true", "true"}},
    {"sensor.unit_exposure_s", {"0.005", "0.005", "0.005", "0.01", "0.02"}},
    {"sensor.max_exposure_s", {"0.015", "0.015", "0.015", "0.025", "0.04"}},
    {"sensor.rolling_shutter_s", {"0", "0.005", "0.015", "0.025", "0.04"}},
    {"sensor.passage_light", {"1", "1.5", "3", "6", "15"}},
    {"sensor.passage_every_s", {"0", "40", "20", "12", "8"}},
    {"sensor.passage_s", {"3", "3", "3", "3", "4"}},
    {"sensor.glare", {"0", "0.05", "0.15", "0.3", "0.6"}},
    {"sensor.dirt", {"0", "0.1", "0.25", "0.5", "0.9"}},
    {"sensor.dirt_spots", {"20", "5", "10", "20", "40"}},
    {"sensor.rain_drops", {"0", "0", "0", "1500", "6000"}},
    {"inertial.gyro_scale", {"0", "0.001", "0.003", "0.01", "0.03"}},
    {"inertial.accel_scale", {"0", "0.001", "0.005", "0.01", "0.03"}},
    {"inertial.misalignment_rad", {"0", "0.0005", "0.002", "0.005", "0.015"}},
    {"inertial.vibration_gyro_rps", {"0", "0.005", "0.02", "0.05", "0.2"}},
    {"inertial.vibration_accel_mps2", {"0", "0.05", "0.3", "1", "4"}},
    {"inertial.vibration_hz", {"37", "37", "37", "71", "197"}},
    {"inertial.warm_gyro_rps", {"0", "0.0005", "0.002", "0.005", "0.02"}},
    {"inertial.warm_accel_mps2", {"0", "0.005", "0.02", "0.05", "0.2"}},
    {"calibration_error.focal_share", {"0", "0.001", "0.002", "0.005", "0.01"}},
    {"calibration_error.mounting_rad", {"0", "0.001", "0.003", "0.0087", "0.0175"}},
    {"calibration_error.stereo_rad", {"0", "0", "0.0002", "0.0005", "0.0015"}},
    {"timing.drift_ppm", {"0", "5", "20", "50", "100"}},
    {"timing.jump_s", {"0", "0", "0", "0.02", "0.1"}},
    {"timing.jump_every_s", {"0", "0", "0", "20", "8"}},
    {"timing.camera_drift_ppm", {"0", "0", "0", "20", "50"}},
    {"timing.camera_delay_s", {"0", "0.0005", "0.002", "0.005", "0.015"}},
    {"timing.dropped_share", {"0", "0.005", "0.02", "0.05", "0.15"}},
    {"timing.dropped_run", {"1", "1", "1.5", "2", "4"}},
    {"traffic.cars", {"0", "4", "10", "16", "30"}},
    {"traffic.people", {"0", "4", "12", "24", "40"}},
    {"places.alike", {"false", "false", "false", "false", "true"}},
    {"places.opposite", {"false", "false", "false", "true", "true"}},
};

// Calls visit(section) for every section of `effects`.
template <typename Visit>
void for_each_section(Effects& effects, const Visit& visit) {
  visit(effects.sensor);
  visit(effects.inertial);
  visit(effects.calibration_error);
  visit(effects.timing);
  visit(effects.traffic);
  visit(effects.places);
}

class KeyTexts : public FieldVisitor<KeyTexts> {
 public:
  KeyTexts(std::string section, std::map<std::string, std::string>& texts)
      : section_(std::move(section)), texts_(texts) {}

  template <typename T, typename Accepted>
  void visit(const char* key, const T& value, const Accepted& accepted, const char* /*text*/) {
    texts_[section_ + '.' + key] = yaml_text(value, accepted);
  }

 private:
  std::string section_;
  std::map<std::string, std::string>& texts_;
};

// A section as text in which each value is in the same line as in its file, for messages.
std::string text_at_its_line(const std::string& name, const YAML::Node& section) {
  std::string text;
  const auto go_to = [&text](int line) {
    const auto present = std::count(text.begin(), text.end(), '\n');
    if (line > present) text.append(static_cast<std::size_t>(line - present), '\n');
  };
  const bool is_block = section.Style() != YAML::EmitterStyle::Flow;  // its name is one line above
  go_to(section.Mark().line - (is_block ? 1 : 0));
  text += name + ": {";
  for (const auto& entry : section) {
    go_to(entry.second.Mark().line);
    text += ' ' + entry.first.Scalar() + ": " + YAML::Dump(entry.second) + ", ";
  }
  return text + "}\n";
}

}  // namespace

std::span<const LevelKey> level_table() {
  return kLevels;
}

Effects load_effects(const EffectLayers& layers) {
  ConfigLayers all;
  for (const LevelKey& key : kLevels)
    all.add_override(std::string(key.key) + '=' +
                     key.values.at(static_cast<std::size_t>(layers.level)));
  for (const auto& [name, section] : layers.sections)
    all.add_text(text_at_its_line(name, section), layers.file);
  for (const std::string& setting : layers.settings) all.add_override(setting);
  Effects effects;
  for_each_section(
      effects, [&all](auto& section) { section = all.load<std::decay_t<decltype(section)>>(); });
  all.finish();
  return effects;
}

std::map<std::string, std::string> key_texts(Effects effects) {
  std::map<std::string, std::string> texts;
  for_each_section(effects, [&texts](auto& section) {
    KeyTexts visitor(std::decay_t<decltype(section)>::kSection, texts);
    section.visit_fields(visitor);
  });
  return texts;
}

std::map<std::string, std::string> changed_keys(const Effects& effects, int level) {
  std::map<std::string, std::string> changed = key_texts(effects);
  for (const auto& [key, value] : key_texts(load_effects({.level = level})))
    if (changed.at(key) == value) changed.erase(key);
  return changed;
}

}  // namespace km
