#pragma once

#include <Eigen/Core>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"

namespace km {

/// A chunk and the present positions of its vertices. The chunk outlives it.
struct PlacedChunk {
  const MeshChunk* chunk = nullptr;
  RobotId anchor = 0;                     ///< Robot whose odometry frame is `world`.
  std::vector<Eigen::Vector3f> vertices;  ///< [m] in `world`.
};

/// Places a chunk with the present poses of its robot's keyframes. A vertex moves with the
/// keyframes that saw it first and last, with equal weights:
///
///     v' = (D_first v + D_last v) / 2,   D_k = T_world_kf(k) now * T_world_kf(k)^-1 when it was
///     sent
///
/// It is the embedded deformation of Sumner, Schmid, Pauly, "Embedded Deformation for Shape
/// Manipulation" (SIGGRAPH 2007), eq. (4), with keyframes as nodes. Between two stated keyframes,
/// `D_k v` is interpolated linearly. mesh_deformation holds its nodes by the same keyframes.
///
/// A chunk without keyframes, or with one whose pose is not in `poses`, stays as it was sent. So
/// does every chunk if `poses` is null. The result depends on the arguments alone, bit by bit (on
/// processors with the same arithmetic). Precondition: fault_of() finds no fault in both.
[[nodiscard]] PlacedChunk place(const MeshChunk& chunk, const MeshPoses* poses);

/// True if `b` has to replace the sent chunk `a` with the same key. Its faces or labels are other
/// ones, or a vertex of `b` is more than `min_move_m` along an axis from where `poses` place it in
/// `a`. Chunks without keyframes also differ if their anchors do. 2 mm are added to `min_move_m` if
/// the poses move `a`, for the rounding of poses.
[[nodiscard]] bool differ(const MeshChunk& a, const MeshChunk& b, double min_move_m,
                          const MeshPoses* poses = nullptr);

}  // namespace km
