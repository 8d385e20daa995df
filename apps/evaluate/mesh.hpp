#pragma once

#include <filesystem>
#include <vector>

#include "modules/evaluation/mesh/mesh_error.hpp"

namespace km {

/// `kimera_multi_evaluate mesh`: what its command line says.
struct MeshCommand {
  std::filesystem::path truth;                      ///< PLY.
  std::vector<std::filesystem::path> estimates;     ///< PLY, one file per robot.
  std::vector<std::filesystem::path> trajectories;  ///< The robots' poses in the meshes' frame,
  std::vector<std::filesystem::path> true_trajectories;  ///< and in the truth's: place the meshes.
  MeshErrorOptions options;
  std::filesystem::path palette;  ///< By default the one beside the truth.
  std::filesystem::path json;     ///< Not written if empty.
};

/// Compares the meshes, prints tables, writes the file asked for; progress on standard error.
/// Throws an exception whose message is one line for bad input.
void evaluate_meshes(const MeshCommand& command);

}  // namespace km
