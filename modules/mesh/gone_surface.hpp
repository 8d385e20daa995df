#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/mesh/chunk_placement.hpp"
#include "modules/mesh/coarse_view.hpp"

namespace km {

/// Cells of a block of 8 x 8 x 8 in which the surface of a robot is gone.
struct GoneBlock {
  RobotId owner = 0;                              ///< Robot that mapped the surface.
  std::array<std::int32_t, 3> block = {0, 0, 0};  ///< [8 cells] in `world`
  std::array<std::uint64_t, 8> cells = {};        ///< Bit x + 8 y of word z.

  bool operator==(const GoneBlock&) const = default;
};

/// Surface of other robots that a robot saw through after it had received it. The newest message of
/// a robot counts. All robots leave the surface out of the fused mesh, also if its owner has left.
struct GoneSurface {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Boot id of the sender; only set in received messages.
  RobotId anchor = 0;      ///< Robot whose odometry frame is `world`.
  float cell_m = 0.1F;
  std::vector<GoneBlock> blocks = {};  ///< Ascending by owner and block, each once.

  bool operator==(const GoneSurface&) const = default;
};

/// Largest number of blocks of a message; the last ones are left out.
inline constexpr std::size_t kMaxGoneBlocks = 384;
/// Bytes of a block on the wire.
inline constexpr std::size_t kGoneBlockBytes = 80;

/// The reason why `gone` cannot be used (a string literal), or null: cells have a size, and blocks
/// ascend.
[[nodiscard]] const char* fault_of(const GoneSurface& gone);

/// True if `gone` states that the surface of `owner` at this point is gone.
[[nodiscard]] bool is_gone(const GoneSurface& gone, RobotId owner, const Eigen::Vector3f& point);

/// Views of a robot, and the poses that place them.
struct OwnViews {
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::vector<std::shared_ptr<const CoarseView>> views = {};
  std::vector<SE3> T_world_odom = {};     ///< T_world_kf * T_odom_kf^-1 by keyframe.
  std::vector<Matrix6> covariances = {};  ///< Covariances of T_world_kf.
};

/// Remembers when the vertices of received chunks arrived, as the newest own keyframe with a view.
/// A vertex that a newer version of its chunk has at the same place keeps its time. Not
/// thread-safe.
class SurfaceArrivals {
 public:
  /// Time of vertices that arrived after the last call of set_newest_view().
  static constexpr KeyframeIndex kPending = 0xFFFFFFFF;

  void take(const MeshChunk& chunk);
  /// Gives its time to all vertices without one.
  void set_newest_view(KeyframeIndex keyframe);
  /// Time of each vertex; empty for an unknown chunk. Valid until the next take().
  [[nodiscard]] std::span<const KeyframeIndex> of(const MeshChunkKey& key) const;

 private:
  using Place = std::array<std::int64_t, 3>;  // [step_m]
  struct Chunk {
    std::uint64_t boot = 0;
    std::vector<Place> places;
    std::vector<KeyframeIndex> arrived;
  };
  std::map<MeshChunkKey, Chunk> chunks_;
};

/// A chunk of another robot, with the keyframe of this robot up to which views do not count for
/// each vertex: the newest when the vertex arrived.
struct TestedChunk {
  const PlacedChunk* placed = nullptr;
  std::span<const KeyframeIndex> arrived;
};

/// Finds the surface of other robots that at least `least_views` own views see through (see
/// SightVotes). A cell is stated if all vertices of one robot in it are seen through.
///
/// Only views after the arrival of a vertex count. They are certainly later than its last sight,
/// although robots have no common clock. The poses of the other robot are taken to be as uncertain
/// as that of the view, and independent of it. The result lacks robot and boot.
[[nodiscard]] GoneSurface find_gone(const OwnViews& own, std::span<const TestedChunk> chunks,
                                    int least_views, double cell_m);

}  // namespace km
