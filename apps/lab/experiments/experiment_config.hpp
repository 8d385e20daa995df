#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// A world, the recordings that robots make in it, and the run of a team on them: a map of
/// worlds.yaml.
struct WorldConfig {
  std::string name;
  std::string repeats = {};     ///< Name of the world that this repeats, or empty.
  std::string recordings = {};  ///< Name of the world that provides the recordings.
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
    visitor.field("robots", robots, "names of the robots, in the order of their ids");
    visitor.field("simulation", simulation, Input{}, "file of options of kimera_multi_simulate");
    visitor.field("simulate", simulate,
                  "more options of kimera_multi_simulate, which override the file");
    visitor.field("flights", flights,
                  "the robots move as EuRoC's recordings of their names did, with the recorded "
                  "inertial data; the original images are used where --euroc has them");
    visitor.field("original_config", original_config, Input{},
                  "configuration of robots on EuRoC's own images");
    visitor.field("team", team, "options of kimera_multi_team");
    visitor.field("robot", robot, "options of every robot");
    visitor.field(
        "runs", runs, {1, 99},
        "number of runs of the team, for the spread; all except for the first without a map");
    visitor.field(
        "seeds", seeds, {0, ~0U},
        "further seeds of the world: each is simulated and run in the same way, without a map");
    visitor.field("picture", picture, "options of kimera_multi_evaluate render");
    visitor.field("simulate_s", simulate_s, {1e-3, 1e6},
                  "[s] approximate time to simulate on two cores, for the remaining time");
    visitor.field("team_s", team_s, {1e-3, 1e6},
                  "[s] approximate time to run the team on two cores, for the remaining time");
    visitor.required({"robots"});
  }
};

/// Time of the clique search by the size of the graph: pcm.yaml.
struct PcmExperiment {
  std::string graph;
  std::size_t closures = 0;
  std::size_t outliers = 0;
  std::vector<unsigned> seeds;
  std::vector<std::string> searches;
  double seed_s = 50.0;

  void visit_fields(auto& visitor) {
    visitor.field("graph", graph, "g2o file, looked for in --graphs");
    visitor.field("closures", closures, {0, 1000000},
                  "number of closures drawn at random from the file; 0: all");
    visitor.field("outliers", outliers, {0, 1000000}, "number of random false closures added");
    visitor.field("seeds", seeds, {0, ~0U},
                  "seeds of the random closures: one run each; the report has medians and ranges");
    visitor.field("searches", searches, "exact, incremental, batch");
    visitor.field("seed_s", seed_s, {1e-3, 1e6},
                  "[s] approximate time of a seed, for the remaining time");
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

/// One robot without a team and without a map.
struct SingleRobotExperiment {
  std::string world;
  std::string robot;
  std::vector<std::string> arguments;

  void visit_fields(auto& visitor) {
    visitor.field("world", world, "world with its recording");
    visitor.field("robot", robot, "robot of that world");
    visitor.field("arguments", arguments, "options of kimera_multi_robot");
    visitor.required({"world", "robot"});
  }
};

/// A world of the levels of difficulty.
struct LevelWorld {
  std::string name;
  std::string title;
  std::vector<std::string> simulate;
  std::string length;
  std::vector<unsigned> levels;

  void visit_fields(auto& visitor) {
    visitor.field("name", name, "part of the names of steps and folders");
    visitor.field("title", title, "for people; default: its name");
    visitor.field("simulate", simulate, "options of kimera_multi_simulate");
    visitor.field("length", length,
                  "for people, for worlds that are judged apart from the others of their level");
    visitor.field("levels", levels, {0, 4}, "levels of this world; default: all");
    visitor.required({"name", "simulate"});
  }
};

/// A level of difficulty of kimera_multi_simulate.
struct LevelSeeds {
  unsigned level = 0;
  std::vector<unsigned> seeds;

  void visit_fields(auto& visitor) {
    visitor.field("level", level, {0, 4}, "level of difficulty");
    visitor.field("seeds", seeds, {0, ~0U}, "seeds of every world");
    visitor.required({"level", "seeds"});
  }
};

/// Worlds that fight back: levels.yaml. Every world is simulated at each of its levels and each
/// seed.
struct LevelExperiment {
  std::vector<LevelWorld> worlds;
  std::vector<LevelSeeds> levels;
  unsigned robots = 2;
  std::vector<std::string> simulate;
  std::vector<std::string> team;
  std::vector<std::string> robot;
  double simulate_s = 400.0;
  double team_s = 90.0;

  void visit_fields(auto& visitor) {
    visitor.field("robots", robots, {1, 99}, "number of robots in every world");
    visitor.field("simulate", simulate, "further options of kimera_multi_simulate");
    visitor.field("team", team, "options of kimera_multi_team");
    visitor.field("robot", robot, "options of every robot");
    visitor.field("simulate_s", simulate_s, {1e-3, 1e6},
                  "[s] approximate time to simulate a world, for the remaining time");
    visitor.field("team_s", team_s, {1e-3, 1e6},
                  "[s] approximate time to run a team, for the remaining time");
  }
};

/// One run of LevelExperiment.
struct LevelRun {
  unsigned level = 0;
  std::string world;        ///< Name in ExperimentConfig::worlds.
  std::string length = {};  ///< See LevelWorld.
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
    visitor.field("arguments", arguments, "options of kimera_multi_pgo solve");
    visitor.required({"name", "arguments"});
  }
};

/// Content of the files in config/experiments/.
struct ExperimentConfig {
  bool quick = false;  ///< Small versions of the experiments.
  /// Worlds of worlds.yaml, each followed by its repetitions: WORLD-run2 on the same recordings,
  /// WORLD-seed2 on those of another seed. Then follow WORLD-paper, the run of the paper's
  /// pipeline, and levelN-WORLD-seedN, the worlds of levels.yaml.
  std::vector<WorldConfig> worlds;
  PcmExperiment pcm;
  CosmoExperiment cosmo;
  SingleRobotExperiment alone;                 ///< An empty world disables this experiment.
  std::vector<std::string> trajectory_worlds;  ///< Names in `worlds`, as in the lists below.
  std::vector<PgoMethodConfig> methods;
  std::vector<std::string> paper_pipeline;  ///< Options of robots that run the paper's pipeline.
  std::vector<std::string> resources_worlds;
  std::vector<std::string> mesh_worlds;
  std::vector<std::string> semantics_worlds;
  std::vector<LevelRun> level_runs;

  /// Precondition: a world of that name exists.
  [[nodiscard]] const WorldConfig& world(const std::string& name) const;

  /// The run of a world's team by the paper's pipeline; nullptr if there is none.
  [[nodiscard]] const WorldConfig* paper_run(const std::string& world) const;

  /// Names of the repetitions of a world.
  [[nodiscard]] std::vector<std::string> repetitions(const std::string& world) const;
};

/// Reads worlds.yaml, pcm.yaml, cosmo.yaml, trajectory.yaml, resources.yaml, mesh.yaml,
/// semantics.yaml and levels.yaml. With `quick` the keys below `quick:` replace those beside it.
/// Throws ConfigError with every problem of all files, by file and line. Names of worlds must be in
/// worlds.yaml.
[[nodiscard]] ExperimentConfig read_experiments(const std::filesystem::path& folder, bool quick);

/// Documentation of the keys of a world, with their defaults.
[[nodiscard]] std::string world_keys();

}  // namespace km
