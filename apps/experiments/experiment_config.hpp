#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// A world, the recordings that robots make in it, and how a team is run on them: a map of
/// worlds.yaml.
struct WorldConfig {
  std::string name;
  std::string repeats = {};     ///< Name of the world this is another run of; or empty.
  std::string recordings = {};  ///< Name of the world whose recordings it is run on.
  std::string title;
  std::vector<std::string> robots;
  std::filesystem::path simulation;
  std::vector<std::string> simulate;
  bool flights = false;
  std::filesystem::path original_config;
  std::vector<std::string> team;
  std::vector<std::string> robot;
  unsigned runs = 1;
  std::vector<unsigned> seeds;
  std::vector<std::string> picture;
  double simulate_s = 600.0;
  double team_s = 300.0;

  void visit_fields(auto& visitor) {
    visitor.field("title", title, "for people; default: its name");
    visitor.field("robots", robots, "their names, in the order of their ids");
    visitor.field("simulation", simulation, Input{}, "file of options of kimera_multi_simulate");
    visitor.field("simulate", simulate, "more options of it, over the file's");
    visitor.field("flights", flights,
                  "the robots move as EuRoC's recordings of their names did, with the recorded "
                  "inertial data; the original images are used where --euroc has them");
    visitor.field("original_config", original_config, Input{}, "of robots on EuRoC's own images");
    visitor.field("team", team, "options of kimera_multi_team");
    visitor.field("robot", robot, "options of every robot");
    visitor.field("runs", runs, {1, 99},
                  "how often the team is run, for the spread; all but the first without a map");
    visitor.field("seeds", seeds, {0, ~0U},
                  "further seeds of the world: simulated and run like it, without a map");
    visitor.field("picture", picture, "options of kimera_multi_evaluate render");
    visitor.field("simulate_s", simulate_s, {1e-3, 1e6},
                  "[s] how long simulating takes on two cores, roughly, for the time left");
    visitor.field("team_s", team_s, {1e-3, 1e6}, "[s] the same of the team");
    visitor.required({"robots"});
  }
};

/// Clique search against the size of the graph: pcm.yaml.
struct PcmExperiment {
  std::string graph;
  std::size_t closures = 0;
  std::size_t outliers = 0;
  std::vector<unsigned> seeds;
  std::vector<std::string> searches;
  double seed_s = 50.0;

  void visit_fields(auto& visitor) {
    visitor.field("graph", graph, "g2o file, looked for in --graphs");
    visitor.field("closures", closures, {0, 1000000}, "of the file's, drawn at random; 0: all");
    visitor.field("outliers", outliers, {0, 1000000}, "random false ones added");
    visitor.field("seeds", seeds, {0, ~0U},
                  "of the random closures: a run each; the report has medians and ranges");
    visitor.field("searches", searches, "exact, incremental, batch");
    visitor.field("seed_s", seed_s, {1e-3, 1e6},
                  "[s] how long a seed takes, roughly, for the time left");
    visitor.required({"graph", "seeds", "searches"});
    for (const std::string& search : searches)
      visitor.check(search == "exact" || search == "incremental" || search == "batch", "searches",
                    "has " + search + ", which is not exact, incremental or batch");
  }
};

/// A graph of COSMO-Bench.
struct CosmoSet {
  std::string graph;
  std::string title;

  /// Name of the file without its extension.
  [[nodiscard]] std::string stem() const { return std::filesystem::path(graph).stem().string(); }

  void visit_fields(auto& visitor) {
    visitor.field("graph", graph, "JRL file, looked for in --graphs");
    visitor.field("title", title, "for people; default: the file's name");
    visitor.required({"graph"});
  }
};

/// Rejection of labelled false closures: cosmo.yaml.
struct CosmoExperiment {
  std::vector<CosmoSet> sets;
};

/// One robot without others and without a map.
struct AloneExperiment {
  std::string world;
  std::string robot;
  std::vector<std::string> arguments;

  void visit_fields(auto& visitor) {
    visitor.field("world", world, "whose recording it is run on");
    visitor.field("robot", robot, "of that world");
    visitor.field("arguments", arguments, "of kimera_multi_robot");
    visitor.required({"world", "robot"});
  }
};

/// A column of the trajectory table.
struct PgoMethodConfig {
  std::string name;
  std::string title;
  std::vector<std::string> arguments;

  void visit_fields(auto& visitor) {
    visitor.field("name", name,
                  "local, rbcd, rbcd50, dgs and centralized are compared with the paper");
    visitor.field("title", title, "for people; default: its name");
    visitor.field("arguments", arguments, "of kimera_multi_pgo solve");
    visitor.required({"name", "arguments"});
  }
};

/// What the files in config/experiments/ say.
struct ExperimentConfig {
  bool quick = false;  ///< Small versions of the experiments.
  /// Those of worlds.yaml, each followed by its repetitions: WORLD-run2 on the same recordings,
  /// WORLD-seed2 on those of another seed. Last WORLD-paper, the run of the paper's pipeline.
  std::vector<WorldConfig> worlds;
  PcmExperiment pcm;
  CosmoExperiment cosmo;
  AloneExperiment alone;                       ///< Without a world: there is no such experiment.
  std::vector<std::string> trajectory_worlds;  ///< Names in `worlds`, as those below.
  std::vector<PgoMethodConfig> methods;
  std::vector<std::string> paper_pipeline;  ///< Options of robots that run the paper's pipeline.
  std::vector<std::string> resources_worlds;
  std::vector<std::string> mesh_worlds;
  std::vector<std::string> semantics_worlds;

  /// Precondition: there is one of that name.
  [[nodiscard]] const WorldConfig& world(const std::string& name) const;

  /// The run of a world's team by the paper's pipeline; nullptr if there is none.
  [[nodiscard]] const WorldConfig* paper_run(const std::string& world) const;

  /// Names of the repetitions of a world.
  [[nodiscard]] std::vector<std::string> repetitions(const std::string& world) const;
};

/// Reads worlds.yaml, pcm.yaml, cosmo.yaml, trajectory.yaml, resources.yaml, mesh.yaml and
/// semantics.yaml.
/// With `quick` the keys below `quick:` replace those beside it. Throws ConfigError with every
/// problem of all files, by file and line; names of worlds must be in worlds.yaml.
[[nodiscard]] ExperimentConfig read_experiments(const std::filesystem::path& folder, bool quick);

/// The keys of a world, with their defaults and meaning.
[[nodiscard]] std::string world_keys();

}  // namespace km
