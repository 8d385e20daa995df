#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "modules/mesh/chunk_placement.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"

namespace km {

/// Result for one chunk.
enum class ChunkVerdict {
  kTaken,
  kEarlierBoot,  ///< Ignored, because the robot has restarted since.
  kNoRoom,       ///< Ignored, because the mesh of the robot would become too large.
};

/// "taken", "of an earlier boot", "no room"
[[nodiscard]] const char* to_string(ChunkVerdict verdict);

/// The meshes of other robots, with the newest chunk of each key and the newest poses of each
/// robot. The mesh of a robot that leaves stays. When a robot restarts, its first message replaces
/// its former mesh. Not thread-safe.
class TeamMesh {
 public:
  /// About 2 million vertices with their faces; a bound for misbehaving peers.
  static constexpr std::size_t kMaxBytesPerRobot = std::size_t{40} << 20U;

  explicit TeamMesh(std::size_t max_bytes_per_robot = kMaxBytesPerRobot)
      : max_bytes_per_robot_(max_bytes_per_robot) {}

  ChunkVerdict add(MeshChunk chunk);
  /// Takes the poses that place the chunks of a robot, before or after them. Never kNoRoom.
  ChunkVerdict add(MeshPoses poses);

  /// All chunks, by their keys, where the newest poses place them. Valid until the next add().
  [[nodiscard]] std::vector<PlacedChunk> placed() const;

 private:
  struct Robot {
    std::uint64_t boot = 0;
    std::set<std::uint64_t> earlier_boots = {};
    std::optional<MeshPoses> poses = {};
    std::map<MeshChunkKey, MeshChunk> chunks = {};
    std::size_t bytes = 0;
  };
  // The robot after a message of its boot `boot`; null for a message of an earlier boot.
  [[nodiscard]] Robot* robot_of(RobotId id, std::uint64_t boot);

  std::size_t max_bytes_per_robot_;
  std::map<RobotId, Robot> robots_;
};

}  // namespace km
