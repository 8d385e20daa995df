#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/team/team_file.hpp"
#include "modules/core/geometry.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"

namespace km {

/// The meshes of a team after the run.
struct TeamMeshes {
  std::optional<MeshReport> odometry;   ///< Of mesh.ply; absent if the truth is unknown.
  std::optional<MeshReport> optimized;  ///< Of mesh_optimized.ply, likewise.
  LabelledMesh merged;                  ///< All mesh_optimized.ply as one, moved; may be empty.
};

/// Reads the meshes that the robots left, merges them in the frame of the true poses, to which
/// `T_truth_team` leads, and compares them with `plan.truth_mesh`: there ICP brings all together
/// onto it, in each of the two cases. What is missing of the robots that made a map is noted.
[[nodiscard]] TeamMeshes collect_meshes(const TeamPlan& plan, const SE3& T_truth_team,
                                        std::vector<std::string>& notes);

/// A table for people: a row per robot and one for all as one; empty without comparisons.
[[nodiscard]] std::string to_table(const TeamMeshes& meshes);

}  // namespace km
