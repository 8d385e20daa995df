#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
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
  std::size_t left_out = 0;  ///< Boxes that were left out, counted for each robot (kMaxMapBoxes).
  std::map<RobotId, Eigen::AlignedBox3f> extents;  ///< Surface of each robot, in `world`.
};

/// Largest number of boxes (SurfaceFusion) with surface: a bound for misbehaving peers.
inline constexpr std::size_t kMaxMapBoxes = std::size_t{1} << 17U;

/// Fuses placed chunks of any robots, sorted by their keys, each key once. A misbehaving robot
/// harms only its own part:
///
/// - The frame is that of most robots. Each robot counts for the frame of most of its chunks. If
///   several are equal, the one of most chunks counts, then that of the robot with the lowest id.
/// - Faces that are longer than a box are left out, because no mapper makes them. So are faces
///   beyond 10,000 km.
/// - With more than `max_boxes` boxes, the robots with most boxes lose boxes, until none has more
///   than an equal share.
///
/// The result depends on the placed chunks and the voxels alone, bit by bit (on processors with the
/// same arithmetic). Two robots with the same chunks and poses therefore have the same map.
///
/// Chunks are fused in voxels of the size that they state, rounded to the smallest one, twice, four
/// times as large and so on. Surface is left out if there is surface from smaller voxels at its
/// place. The smallest size is the median of the smallest sizes of the robots, the coarser one of
/// two. Chunks that state none have this size. It is 0.1 m if no chunk states one.
[[nodiscard]] TeamMap fuse_chunks(const std::vector<PlacedChunk>& chunks,
                                  std::size_t max_boxes = kMaxMapBoxes);

/// The plan of the map with as many robots as have room together in `max_cells` squares of
/// `cell_m`: the others are too far away or too large. If there are several such plans, it is the
/// one around the robot with the lowest id.
[[nodiscard]] Eigen::AlignedBox2f plan_of(const std::map<RobotId, Eigen::AlignedBox3f>& extents,
                                          double cell_m, double max_cells);

/// A mesh on its own in voxels of another size. Throws under the conditions of split_mesh().
[[nodiscard]] LabelledMesh resampled(const LabelledMesh& mesh, double voxel_m);

}  // namespace km
