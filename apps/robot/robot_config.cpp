#include "apps/robot/robot_config.hpp"

#include <type_traits>

#include "apps/program_version.hpp"
#include "modules/core/input_file.hpp"
#include "runtime/config_layers.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Folders of the files that come with the program.
std::vector<fs::path> config_folders() {
  const fs::path program = program_folder();
  return {"config", program / "../../config", program / "../share/kimera_multi"};
}

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
  std::string list;
  for (const std::string& peer : options.peers) list += (list.empty() ? "" : ", ") + peer;
  layers.add_override("dds.peers=[" + list + "]");
  layers.add_override("dds.discovery=peers");
}

}  // namespace

fs::path find_shipped_file(const std::string& name, const char* key) {
  const std::string start = std::string(key) + ": ";
  if (name.empty()) throw ConfigError(start + "names no file");
  std::vector<fs::path> places{fs::path(name)};
  for (const fs::path& root : config_folders()) places.push_back(root / name);
  std::string tried;
  for (const fs::path& place : places) {
    if (is_file(place)) return place;
    tried += "\n  " + place.lexically_normal().string();
    if (fs::is_directory(place)) tried += " (a folder)";
    if (place.is_absolute() && place == name) break;
  }
  throw ConfigError(start + "no file " + name + "; looked for" + tried);
}

fs::path find_named_file(const std::string& folder, const std::string& name) {
  if (is_file(name)) return name;
  std::vector<fs::path> named;
  std::string known;
  for (const fs::path& root : config_folders()) {
    std::vector<fs::path> files = entries_of(root / folder);
    std::erase_if(files, [](const fs::path& file) { return file.extension() != ".yaml"; });
    for (const fs::path& file : files) {
      const std::string stem = file.stem();
      if (stem == name) return file;
      if (stem.ends_with(name)) named.push_back(file);
      known += (known.empty() ? "" : ", ") + stem;
    }
    if (!files.empty()) break;
  }
  if (named.size() == 1) return named.front();
  throw ConfigError("no file " + name + ", and " + (named.empty() ? "none" : "several") +
                    " of this name in " + folder + ": " + known);
}

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
