#include "apps/experiments/experiment_config.hpp"

#include <algorithm>

#include "apps/experiments/yaml_keys.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

constexpr const char* kTexts = "a list of texts";

YAML::Node load(const YamlSource& source) {
  if (!fs::is_regular_file(source.file))
    throw ExperimentConfigError(source.file.string() + ": no such file");
  try {
    return YAML::LoadFile(source.file.string());
  } catch (const YAML::Exception& error) {
    throw ExperimentConfigError(source.file.string() + " line " +
                                std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
}

Texts texts(YamlKeys& keys, const std::string& key) {
  return keys.get<Texts>(key, kTexts).value_or(Texts{});
}

WorldConfig read_world(YamlSource& source, const std::string& name, const YAML::Node& node,
                       bool quick) {
  YamlKeys keys(source, node, quick);
  WorldConfig world;
  world.name = name;
  world.title = keys.get<std::string>("title", "a text").value_or(name);
  const auto file = [&](const char* key) -> fs::path {
    const auto text = keys.get<std::string>(key, "a path");
    if (!text || text->empty()) return {};
    const fs::path path = (source.file.parent_path() / *text).lexically_normal();
    if (!fs::is_regular_file(path))
      source.problem(keys.child(key), "no such file: " + path.string());
    return path;
  };
  world.simulation = file("simulation");
  world.original_config = file("original_config");
  world.simulate = texts(keys, "simulate");
  world.robots = keys.require<Texts>("robots", kTexts);
  if (const YAML::Node robots = keys.child("robots"); robots && world.robots.empty())
    source.problem(robots, "robots is empty");
  world.flights = keys.get<bool>("flights", "true or false").value_or(false);
  world.team = texts(keys, "team");
  world.robot = texts(keys, "robot");
  world.picture = texts(keys, "picture");
  for (const auto& [key, value] :
       {std::pair{"simulate_s", &world.simulate_s}, std::pair{"team_s", &world.team_s}}) {
    *value = keys.get<double>(key, "a number of seconds").value_or(*value);
    if (!(*value > 0.0)) source.problem(keys.child(key), std::string(key) + " is not positive");
  }
  keys.finish();
  return world;
}

std::vector<WorldConfig> read_worlds(YamlSource source, bool quick) {
  std::vector<WorldConfig> worlds;
  const YAML::Node root = load(source);
  if (!root.IsMap()) source.problem(root, "expected a world and its keys here");
  if (root.IsMap())
    for (const auto& entry : root)
      worlds.push_back(read_world(source, entry.first.Scalar(), entry.second, quick));
  return worlds;
}

PcmExperiment read_pcm(YamlSource source, bool quick) {
  const YAML::Node root = load(source);
  YamlKeys keys(source, root, quick);
  PcmExperiment pcm;
  pcm.graph = keys.require<std::string>("graph", "a path");
  pcm.closures = keys.get<std::size_t>("closures", "a number").value_or(0);
  pcm.outliers = keys.get<std::size_t>("outliers", "a number").value_or(0);
  pcm.seeds = keys.require<std::vector<unsigned>>("seeds", "a list of numbers");
  pcm.searches = keys.require<Texts>("searches", kTexts);
  for (const std::string& search : pcm.searches)
    if (search != "exact" && search != "incremental" && search != "batch")
      source.problem(keys.child("searches"), search + " is not exact, incremental or batch");
  for (const auto& [key, empty] :
       {std::pair{"searches", pcm.searches.empty()}, std::pair{"seeds", pcm.seeds.empty()}})
    if (const YAML::Node node = keys.child(key); node && node.IsSequence() && empty)
      source.problem(node, std::string(key) + " is empty");
  keys.finish();
  return pcm;
}

PgoMethodConfig read_method(YamlSource& source, const YAML::Node& node, bool quick) {
  YamlKeys keys(source, node, quick);
  PgoMethodConfig method;
  method.name = keys.require<std::string>("name", "a text");
  method.title = keys.get<std::string>("title", "a text").value_or(method.name);
  method.arguments = keys.require<Texts>("arguments", kTexts);
  keys.finish();
  return method;
}

Texts read_names(YamlSource& source, YamlKeys& keys, const std::vector<WorldConfig>& worlds) {
  Texts names = keys.require<Texts>("worlds", kTexts);
  for (const std::string& name : names)
    if (std::none_of(worlds.begin(), worlds.end(), [&](const auto& w) { return w.name == name; }))
      source.problem(keys.child("worlds"), "no world " + name + " in worlds.yaml");
  return names;
}

Texts read_world_names(YamlSource source, const std::vector<WorldConfig>& worlds, bool quick) {
  const YAML::Node root = load(source);
  YamlKeys keys(source, root, quick);
  Texts names = read_names(source, keys, worlds);
  keys.finish();
  return names;
}

void read_trajectory(YamlSource source, bool quick, ExperimentConfig& config) {
  const YAML::Node root = load(source);
  YamlKeys keys(source, root, quick);
  config.trajectory_worlds = read_names(source, keys, config.worlds);
  const YAML::Node methods = keys.child("methods");
  if (!methods || !methods.IsSequence() || methods.size() == 0)
    source.problem(root, "methods is not a list of at least one method");
  else
    for (const YAML::Node& node : methods)
      config.methods.push_back(read_method(source, node, quick));
  keys.finish();
}

}  // namespace

const WorldConfig& ExperimentConfig::world(const std::string& name) const {
  return *std::find_if(worlds.begin(), worlds.end(),
                       [&](const WorldConfig& world) { return world.name == name; });
}

ExperimentConfig read_experiments(const fs::path& folder, bool quick) {
  std::string problems;
  const auto source = [&](const char* name) { return YamlSource{folder / name, problems}; };
  ExperimentConfig config;
  config.quick = quick;
  config.worlds = read_worlds(source("worlds.yaml"), quick);
  config.pcm = read_pcm(source("pcm.yaml"), quick);
  read_trajectory(source("trajectory.yaml"), quick, config);
  config.resources_worlds = read_world_names(source("resources.yaml"), config.worlds, quick);
  config.mesh_worlds = read_world_names(source("mesh.yaml"), config.worlds, quick);
  config.semantics_worlds = read_world_names(source("semantics.yaml"), config.worlds, quick);
  if (!problems.empty()) throw ExperimentConfigError(problems);
  return config;
}

}  // namespace km
