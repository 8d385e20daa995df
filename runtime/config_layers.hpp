#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "runtime/config_text.hpp"
#include "runtime/yaml_config.hpp"

namespace km {

/// A configuration composed of files and command-line overrides: a later layer replaces keys of
/// earlier ones. Problems are collected over all layers and sections and thrown together by
/// finish(), each with its file and line:
///
///     ConfigLayers layers;
///     layers.add_file("config/robot.yaml");
///     layers.add_override("vio.gyro_noise_factor=16");
///     const auto vio = layers.load<VioConfig>();
///     const auto pcm = layers.load<PcmConfig>();
///     layers.finish();
class ConfigLayers {
 public:
  /// A YAML file with a map of sections.
  void add_file(const std::filesystem::path& file);

  /// YAML `text`; `origin` stands for the file in messages.
  void add_text(const std::string& text, const std::string& origin);

  /// "section.key=value", the value in YAML: numbers, words, [a, b].
  void add_override(const std::string& assignment);

  /// The section Config::kSection; fields that are absent or wrong keep their defaults.
  template <typename Config>
  [[nodiscard]] Config load() {
    known_.insert(Config::kSection);
    Config config;
    fill_config(sections_[Config::kSection], Config::kSection, ConfigContext{problems_}, config);
    if (!effective_.empty()) effective_ += '\n';
    effective_ += to_yaml(config);
    return config;
  }

  /// Throws ConfigError that lists every problem, including sections that no module loaded.
  void finish() const;

  /// The loaded configuration as text. A file with this text yields the same configuration.
  [[nodiscard]] const std::string& effective() const { return effective_; }

 private:
  void add_document(const YAML::Node& document, const std::string& origin);

  std::map<std::string, ConfigSection> sections_;
  std::set<std::string> known_;
  ConfigProblems problems_;
  std::string effective_;
};

}  // namespace km
