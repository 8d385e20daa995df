#pragma once

#include <filesystem>
#include <vector>

#include "modules/evaluation/closure_truth.hpp"

namespace km {

/// `kimera_multi_evaluate closures`: what its command line says.
struct ClosuresCommand {
  std::vector<std::filesystem::path> truths;   ///< One for all robots, or one for each.
  std::vector<std::filesystem::path> results;  ///< A robot's results folder each.
  std::filesystem::path dataset;               ///< EuRoC/ASL folder with the robots' left camera.
  ClosureTruthOptions options;
  std::filesystem::path json;  ///< Not written if empty.
};

/// Judges the closures of a finished run against the truth, prints the table, writes the file asked
/// for. Throws an exception whose message is one line for bad input.
void evaluate_closures(const ClosuresCommand& command);

}  // namespace km
