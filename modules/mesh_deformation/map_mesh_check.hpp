#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "modules/core/geometry.hpp"
#include "modules/mesh/map_mesh.hpp"

namespace km {

/// Throws std::invalid_argument that names the first problem: `seen_by` not as long as the
/// vertices, first after last keyframe, a keyframe from `keyframes` on, a vertex that is not finite
/// or beyond 10,000 km, a face that names a vertex which does not exist, ids not as long as the
/// vertices or not ascending, certainty not as long as the vertices.
void check_map_mesh(const MapMesh& map, std::size_t keyframes);

/// Throws std::invalid_argument that names the first pose that is not finite or not rigid; `what`
/// says which poses these are.
void check_poses(std::span<const SE3> poses, std::string_view what);

/// Throws std::invalid_argument for poses that check_poses() refuses, more optimised poses than
/// keyframes, and none though there are some.
void check_trajectories(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf);

}  // namespace km
