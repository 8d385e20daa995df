#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/experiments/experiment_config.hpp"
#include "apps/lab/experiments/step_record.hpp"

namespace km {

/// Existing files of one of EuRoC's recordings.
struct RecordedFlightFiles {
  std::filesystem::path folder;  ///< ASL folder with images of both cameras; or empty.
  std::filesystem::path truth;   ///< True poses (CSV or TUM, perhaps gzipped); or empty.
  std::filesystem::path imu;     ///< Inertial data; or empty.
};

/// Searches below `place` for the recording `name`, at most three levels deep. Finds an ASL folder
/// whose name begins with it (V1_01_easy, with mav0 in it), and files NAME*.csv or NAME*.txt,
/// perhaps with .gz. Files with "imu" in their name are inertial data, others true poses. An ASL
/// folder counts only if its left images span at least `least_s`, because an excerpt is not the
/// flight. The first by name counts.
[[nodiscard]] RecordedFlightFiles find_recorded_flight(const std::filesystem::path& place,
                                                       const std::string& name,
                                                       double least_s = 30.0);

/// Folders of inputs and outputs.
struct ExperimentPaths {
  std::filesystem::path programs;  ///< Folder of the other programs.
  std::filesystem::path data;      ///< Recordings and results of the teams' runs.
  std::filesystem::path results;
  std::filesystem::path graphs;  ///< Recorded pose graphs.
  std::filesystem::path euroc;   ///< EuRoC's recordings, see find_recorded_flight(); or empty.
};

/// Name and subject of an experiment.
struct ExperimentName {
  const char* name;
  const char* about;
};

inline constexpr std::array kExperiments = {
    ExperimentName{"pcm", "outlier rejection: time and clique against the size of the graph"},
    ExperimentName{"cosmo", "closures kept and errors on COSMO-Bench, beside published ones"},
    ExperimentName{"trajectory", "errors and costs of local, distributed and central optimisation"},
    ExperimentName{"resources", "bytes, rounds and seconds; what the robots' processors do"},
    ExperimentName{"mesh", "error of the meshes before and after their correction"},
    ExperimentName{"semantics", "right labels before and after the correction"},
    ExperimentName{"levels", "worlds that fight back: errors and closures by level of difficulty"}};

/// Files of a world, as the steps make them.
struct WorldFiles {
  std::filesystem::path recordings;  ///< Folder with simulation.json, if the world is simulated.
  std::filesystem::path team_file;
  std::filesystem::path run;        ///< Results of the team, a folder per robot.
  std::filesystem::path team_json;  ///< JSON file with the tables of the team.
  bool original = false;            ///< EuRoC's own images.
};

[[nodiscard]] WorldFiles world_files(const WorldConfig& world, const ExperimentPaths& paths);

/// Results of a method on the graph of a world.
struct PgoFiles {
  std::filesystem::path json, poses;
};

[[nodiscard]] std::filesystem::path graph_folder(const WorldConfig& world,
                                                 const ExperimentPaths& paths);
[[nodiscard]] PgoFiles pgo_files(const WorldConfig& world, const PgoMethodConfig& method,
                                 const ExperimentPaths& paths);

/// Files of a robot that runs alone.
struct AloneFiles {
  std::filesystem::path recording;
  std::filesystem::path run;
};
[[nodiscard]] AloneFiles alone_files(const ExperimentConfig& config, const ExperimentPaths& paths);

struct PcmFiles {
  std::filesystem::path json, plot;
};
[[nodiscard]] PcmFiles pcm_files(unsigned seed, const ExperimentPaths& paths);

[[nodiscard]] std::string cosmo_step_name(const CosmoSet& set);
/// JSON with the result on a set of COSMO-Bench.
[[nodiscard]] std::filesystem::path cosmo_file(const CosmoSet& set, const ExperimentPaths& paths);

/// PNG of the meshes of all robots.
[[nodiscard]] std::filesystem::path picture_file(const WorldConfig& world, bool corrected,
                                                 const ExperimentPaths& paths);

/// The steps of an experiment, in the order of their dependences. They depend on existing files:
/// recordings and team results that were made elsewhere are used as they are. Nothing is written.
/// Precondition: `experiment` is one of kExperiments.
[[nodiscard]] std::vector<Step> plan_experiment(const std::string& experiment,
                                                const ExperimentConfig& config,
                                                const ExperimentPaths& paths);

/// The steps of several experiments; common ones appear once.
[[nodiscard]] std::vector<Step> plan_experiments(const std::vector<std::string>& experiments,
                                                 const ExperimentConfig& config,
                                                 const ExperimentPaths& paths);

}  // namespace km
