#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace km {

/// Configuration of the experiments that cannot be used. what() lists every problem with file and
/// line.
struct ExperimentConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A world, the recordings that robots make in it, and how a team is run on them.
struct WorldConfig {
  std::string name;                       ///< Of its files; known ones are compared with the paper.
  std::string repeats = {};               ///< Name of the world this is another run of; or empty.
  std::string recordings = {};            ///< Name of the world whose recordings it is run on.
  std::string title;                      ///< "City".
  std::filesystem::path simulation;       ///< Options file of kimera_multi_simulate; may be empty.
  std::vector<std::string> simulate;      ///< More options of kimera_multi_simulate.
  std::vector<std::string> robots;        ///< Their names, in the order of their ids.
  bool flights = false;                   ///< The robots move as EuRoC's recordings of their names.
  std::filesystem::path original_config;  ///< Of robots on EuRoC's own images; may be empty.
  std::vector<std::string> team;          ///< Options of kimera_multi_team.
  std::vector<std::string> robot;         ///< Options of every robot.
  std::vector<std::string> picture;       ///< Options of kimera_multi_evaluate render.
  double simulate_s = 600.0;  ///< How long simulating takes, roughly, for the time left.
  double team_s = 300.0;      ///< Likewise the team.
};

/// Clique search against the size of the graph.
struct PcmExperiment {
  std::string graph;  ///< g2o file, looked for in the folder of data.
  std::size_t closures = 0;
  std::size_t outliers = 0;
  std::vector<unsigned> seeds;
  std::vector<std::string> searches;  ///< As kimera_multi_pgo pcm names them.
  double seed_s = 50.0;               ///< How long a seed takes, roughly, for the time left.
};

/// One robot without others and without a map.
struct AloneExperiment {
  std::string world;  ///< Whose recording it is run on; empty: there is no such experiment.
  std::string robot;
  std::vector<std::string> arguments;  ///< Of kimera_multi_robot.
};

/// A column of the trajectory table.
struct PgoMethodConfig {
  std::string name;  ///< local, rbcd, rbcd50, dgs and centralized are compared with the paper.
  std::string title;
  std::vector<std::string> arguments;  ///< Of kimera_multi_pgo solve.
};

/// What the files in config/experiments/ say.
struct ExperimentConfig {
  bool quick = false;  ///< Small versions of the experiments.
  /// Those of worlds.yaml, each followed by its repetitions: WORLD-run2 on the same recordings,
  /// WORLD-seed2 on those of another seed.
  std::vector<WorldConfig> worlds;
  PcmExperiment pcm;
  AloneExperiment alone;
  std::vector<std::string> trajectory_worlds;  ///< Names in `worlds`, as those below.
  std::vector<PgoMethodConfig> methods;
  std::vector<std::string> resources_worlds;
  std::vector<std::string> mesh_worlds;
  std::vector<std::string> semantics_worlds;

  /// Precondition: there is one of that name.
  [[nodiscard]] const WorldConfig& world(const std::string& name) const;

  /// Names of the repetitions of a world.
  [[nodiscard]] std::vector<std::string> repetitions(const std::string& world) const;
};

/// Reads worlds.yaml, pcm.yaml, trajectory.yaml, resources.yaml, mesh.yaml and semantics.yaml.
/// With `quick` the keys below `quick:` replace those beside it. Throws ExperimentConfigError for
/// files that are missing or no YAML, for unknown keys, wrong types, missing values, and names of
/// worlds that are not in worlds.yaml.
[[nodiscard]] ExperimentConfig read_experiments(const std::filesystem::path& folder, bool quick);

}  // namespace km
