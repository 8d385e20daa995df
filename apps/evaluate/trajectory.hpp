#pragma once

#include <filesystem>
#include <limits>
#include <vector>

#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// `kimera_multi_evaluate trajectory`: what its command line says.
struct TrajectoryCommand {
  std::vector<std::filesystem::path> truths;     ///< One for all estimates, or one for each.
  std::vector<std::filesystem::path> estimates;  ///< TUM or EuRoC CSV.
  double from_s = -std::numeric_limits<double>::infinity();
  double to_s = std::numeric_limits<double>::infinity();
  TrajectoryErrorOptions options;
  std::filesystem::path json;  ///< Not written if empty.
  std::filesystem::path plot;  ///< Not written if empty.
};

/// Compares the estimates with the truth under one alignment, prints the table, writes the files
/// asked for. Throws an exception whose message is one line for bad input.
void evaluate_trajectories(const TrajectoryCommand& command);

}  // namespace km
