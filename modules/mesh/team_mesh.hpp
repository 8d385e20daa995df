#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/mesh_chunks.hpp"

namespace km {

/// What became of a chunk.
enum class ChunkVerdict {
  kTaken,
  kEarlierBoot,  ///< Of a process whose robot has been restarted since: ignored.
  kNoRoom,       ///< Its robot's mesh would become too large: ignored.
};

/// "taken", "of an earlier boot", "no room"
[[nodiscard]] const char* to_string(ChunkVerdict verdict);

/// The mesh of one robot, as far as it has arrived.
struct RobotMesh {
  RobotId robot = 0;
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  LabelledMesh mesh;   ///< In `world`.
  std::size_t chunks = 0;
  std::size_t outdated_chunks = 0;  ///< Left out: another anchor's or step's.
};

/// The meshes of other robots: of each piece the newest chunk. A robot that leaves keeps its mesh;
/// one that restarts begins anew with its first chunk. Not thread-safe.
class TeamMesh {
 public:
  /// About 2 million vertices with their faces; a hostile peer gets no more.
  static constexpr std::size_t kMaxBytesPerRobot = std::size_t{40} << 20U;

  explicit TeamMesh(std::size_t max_bytes_per_robot = kMaxBytesPerRobot)
      : max_bytes_per_robot_(max_bytes_per_robot) {}

  ChunkVerdict add(MeshChunk chunk);

  /// By robot, ascending.
  [[nodiscard]] std::vector<RobotMesh> snapshot() const;

 private:
  struct Robot {
    std::uint64_t boot = 0;
    std::set<std::uint64_t> earlier_boots = {};
    RobotId anchor = 0;  // of the newest chunk
    float step_m = 0.0F;
    std::map<MeshChunkKey, MeshChunk> chunks = {};
    std::size_t bytes = 0;
  };
  std::size_t max_bytes_per_robot_;
  std::map<RobotId, Robot> robots_;
};

}  // namespace km
