#include "modules/mesh/team_mesh.hpp"

#include <array>
#include <utility>

namespace km {

const char* to_string(ChunkVerdict verdict) {
  constexpr std::array kNames = {"taken", "of an earlier boot", "no room"};  // as the enumerators
  return kNames.at(static_cast<std::size_t>(verdict));
}

TeamMesh::Robot* TeamMesh::robot_of(RobotId id, std::uint64_t boot) {
  Robot& robot = robots_.try_emplace(id, Robot{.boot = boot}).first->second;
  if (robot.earlier_boots.contains(boot)) return nullptr;
  if (boot != robot.boot) {
    auto earlier = std::move(robot.earlier_boots);
    earlier.insert(robot.boot);
    robot = {.boot = boot, .earlier_boots = std::move(earlier)};
  }
  return &robot;
}

ChunkVerdict TeamMesh::add(MeshPoses poses) {
  Robot* const robot = robot_of(poses.robot, poses.boot);
  if (robot == nullptr) return ChunkVerdict::kEarlierBoot;
  robot->poses = std::move(poses);
  return ChunkVerdict::kTaken;
}

ChunkVerdict TeamMesh::add(MeshChunk chunk) {
  Robot* const sender = robot_of(chunk.key.robot, chunk.boot);
  if (sender == nullptr) return ChunkVerdict::kEarlierBoot;
  Robot& robot = *sender;
  const auto before = robot.chunks.find(chunk.key);
  std::size_t bytes = robot.bytes;
  if (before != robot.chunks.end()) bytes -= plain_bytes(before->second);
  if (chunk.empty()) {
    robot.bytes = bytes;
    if (before != robot.chunks.end()) robot.chunks.erase(before);
    return ChunkVerdict::kTaken;
  }
  bytes += plain_bytes(chunk);
  if (bytes > max_bytes_per_robot_) return ChunkVerdict::kNoRoom;
  robot.bytes = bytes;
  const MeshChunkKey key = chunk.key;
  robot.chunks.insert_or_assign(key, std::move(chunk));
  return ChunkVerdict::kTaken;
}

std::vector<PlacedChunk> TeamMesh::placed() const {
  std::vector<PlacedChunk> all;
  for (const auto& [id, robot] : robots_)
    for (const auto& [key, chunk] : robot.chunks)
      all.push_back(place(chunk, robot.poses ? &*robot.poses : nullptr));
  return all;
}

}  // namespace km
