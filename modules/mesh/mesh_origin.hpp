#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// The map from which a mesh in `world` was deformed: the keyframes that saw it, and their poses.
struct MeshOrigin {
  /// First and last keyframe that saw each vertex.
  std::vector<std::array<KeyframeIndex, 2>> seen_by;
  std::vector<SE3> T_world_kf;  ///< Poses with which the mesh was placed; all of these keyframes.
  /// Position of each vertex before the deformation, in the robot's odometry frame [m].
  std::vector<Eigen::Vector3f> mapped = {};
  double voxel_m = 0.0;  ///< Side of the smallest voxels of the map [m]; 0: unknown.
  std::vector<std::uint8_t> levels = {};  ///< MapMesh::levels of the vertices.
};

}  // namespace km
