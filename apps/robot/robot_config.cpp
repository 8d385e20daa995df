#include "apps/robot/robot_config.hpp"

#include <algorithm>
#include <type_traits>

#include "apps/shipped_file.hpp"
#include "runtime/config_layers.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Link profile that the files or the command line choose. It must be read before all of them.
std::string chosen_link(const RobotOptions& options) {
  if (!options.link.empty()) return options.link;
  ConfigLayers layers;
  for (const fs::path& file : options.configs) layers.add_file(file);
  for (const std::string& setting : options.settings) layers.add_override(setting);
  return layers.load<RunConfig>().link;
}

fs::path link_profile(const std::string& link) {
  const bool is_name = link.find('/') == std::string::npos && !link.ends_with(".yaml");
  return find_shipped_file(is_name ? "qos/" + link + ".yaml" : link, "run.link");
}

void apply_options(const RobotOptions& options, ConfigLayers& layers) {
  layers.add_override("run.link=" + chosen_link(options));
  if (options.domain) layers.add_override("dds.domain=" + std::to_string(*options.domain));
  if (!options.interface_name.empty())
    layers.add_override("dds.interface=" + options.interface_name);
  if (options.view) layers.add_override("view.on=true");
  if (options.peers.empty()) return;
  try {
    if (std::ranges::count(network_interfaces({}), false, &NetworkInterface::loopback) > 0)
      check_hosts(options.peers);
  } catch (const ConfigError& error) {
    throw CommandLineError(error.what());
  }
  std::string list;
  for (const std::string& peer : options.peers) list += (list.empty() ? "" : ", ") + peer;
  layers.add_override("dds.peers=[" + list + "]");
  layers.add_override("dds.discovery=peers");
}

}  // namespace

RobotConfig load_robot_config(const RobotOptions& options) {
  ConfigLayers layers;
  layers.add_file(link_profile(chosen_link(options)));
  for (const fs::path& file : options.configs) layers.add_file(file);
  for (const std::string& setting : options.settings) layers.add_override(setting);
  apply_options(options, layers);

  RobotConfig config;
  config.visit_sections([&layers](auto& section) {
    section = layers.load<std::remove_cvref_t<decltype(section)>>();
  });
  layers.finish();
  config.effective = layers.effective();
  return config;
}

}  // namespace km
