#pragma once

#include <filesystem>
#include <vector>

#include "modules/pose_graph/team/team_graph.hpp"

namespace km {

/// Throws std::runtime_error unless the file's name ends in .tum or .g2o.
void check_output_name(const std::filesystem::path& file);

/// Writes poses of `graph` by the ending of `file`: *.tum has a row for each, its number in place
/// of a time; *.g2o the graph with these poses and isotropic weights, its verticals included, in 3D
/// also if it is planar. Throws std::runtime_error if the file cannot be written.
void write_poses(const std::filesystem::path& file, const TeamGraph& graph,
                 const std::vector<SE3>& T_world_kf);

}  // namespace km
