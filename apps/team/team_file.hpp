#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/evaluation/closure_truth.hpp"

namespace km {

/// A team file that cannot be used. what() lists every problem with file and line.
struct TeamFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One robot of a team and its input: a sensor recording or a pose graph.
struct RobotPlan {
  RobotId id = 0;
  std::string name;               ///< Unique; also the name of its results folder.
  std::filesystem::path dataset;  ///< EuRoC/ASL folder; empty if `graph` is given.
  std::filesystem::path graph;    ///< Recorded pose graph.
  std::optional<double> from_s;   ///< Part of the recording [s since its first image].
  std::optional<double> to_s;
  /// File of true poses, the team's by default; empty: unknown.
  std::filesystem::path truth;
  std::vector<std::string> arguments;  ///< More arguments of its command line.
};

/// A team to start on this host.
struct TeamPlan {
  std::vector<std::filesystem::path> configs;  ///< Configuration files, as for the robot.
  std::string rate = "1.0";                    ///< Times real time, or "max".
  std::optional<std::uint32_t> domain;         ///< DDS domain; drawn at random if absent.
  std::filesystem::path output;                ///< Results, one folder per robot.
  std::optional<double> time_limit_s;          ///< The team is asked to end after this.
  ClosureTruthOptions closure_truth;           ///< When a closure counts as true.
  std::filesystem::path truth_mesh;            ///< PLY, in the frame of true poses; or empty.
  std::vector<RobotPlan> robots;
  std::vector<std::string> notes;  ///< What cannot be had, for the table.
};

/// True for what --rate of a robot takes: a positive number, or max.
[[nodiscard]] bool is_rate(const std::string& text);

/// Reads a team file. Relative paths of inputs are relative to the file's folder, `output` to the
/// working directory; ${DATASET} in a path stands for `dataset`. A truth may be a folder that holds
/// the file; one that does not exist is a note. Throws TeamFileError for unknown
/// keys, wrong types, missing inputs, ids or names used twice, and ${DATASET} without `dataset`.
[[nodiscard]] TeamPlan read_team_file(const std::filesystem::path& file,
                                      const std::filesystem::path& dataset);

}  // namespace km
