#pragma once

#include <cstddef>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/mesh/chunk_placement.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// The fused mesh of a team.
struct TeamMap {
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  LabelledMesh mesh;   ///< In `world`; with labels and colours if any chunk has some.
  std::size_t other_frames =
      0;                     ///< Chunks that were left out, because their anchor is another one.
  std::size_t left_out = 0;  ///< Boxes with surface that were left out (kMaxMapBoxes).
};

/// Largest number of boxes (SurfaceFusion) with surface: a bound for misbehaving peers.
inline constexpr std::size_t kMaxMapBoxes = std::size_t{1} << 17U;

/// Fuses placed chunks of any robots, sorted by their keys, each key once. The frame is that of
/// most chunks; of several such frames it is that of the robot with the lowest id. Faces that are
/// longer than a box are left out, because no mapper makes them. So are faces beyond 10,000 km.
///
/// The result depends on the placed chunks and the voxels alone, bit by bit (on processors with the
/// same arithmetic). Two robots with the same chunks and poses therefore have the same map.
///
/// The voxels are those of the robots' maps: for each robot the largest that its chunks state, and
/// of these the median, the coarser one of two. Without statements they have `voxel_m`. Throws
/// std::invalid_argument if this is not positive.
[[nodiscard]] TeamMap fuse_chunks(const std::vector<PlacedChunk>& chunks, double voxel_m);

/// A mesh on its own in voxels of another size. Throws under the conditions of split_mesh() and
/// fuse_chunks().
[[nodiscard]] LabelledMesh resampled(const LabelledMesh& mesh, double voxel_m);

}  // namespace km
