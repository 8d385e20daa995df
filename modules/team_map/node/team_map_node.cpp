#include "modules/team_map/node/team_map_node.hpp"

#include <string>
#include <utility>

#include "runtime/log.hpp"
#include "runtime/thread.hpp"

namespace km {
namespace {

// Larger than the number of messages that can arrive while a mesh is fused, so that no sender
// waits.
constexpr std::size_t kQueue = 4096;

}  // namespace

TeamMapNode::TeamMapNode(double voxel_m, LabelPalette palette, const TeamMapTopics& topics)
    : voxel_m_(voxel_m),
      palette_(std::move(palette)),
      worker_(
          kQueue, Overflow::kBlock,
          [this](const Input& input) {
            work_in_background();
            take(input);
          },
          "team_map") {
  for (const In<MeshChunk>& chunks : {topics.own_chunks, topics.received_chunks})
    chunks.subscribe([this](const auto& chunk) { worker_.post(chunk); });
  for (const In<MeshPoses>& poses : {topics.own_poses, topics.received_poses})
    poses.subscribe([this](const auto& newest) { worker_.post(newest); });
}

void TeamMapNode::take(const Input& input) {
  const std::lock_guard lock(mutex_);
  const auto* const chunk = std::get_if<Topic<MeshChunk>::Message>(&input);
  const auto* const poses = std::get_if<Topic<MeshPoses>::Message>(&input);
  const RobotId robot = chunk != nullptr ? (*chunk)->key.robot : (*poses)->robot;
  const ChunkVerdict verdict = chunk != nullptr ? chunks_.add(**chunk) : chunks_.add(**poses);
  if (verdict != ChunkVerdict::kTaken)
    log::limited(log::Level::kWarn, name(), std::to_string(robot))
        << (chunk != nullptr ? "a chunk of robot " : "poses of robot ") << robot
        << " ignored: " << to_string(verdict);
}

TeamMap TeamMapNode::fuse() const {
  const std::lock_guard lock(mutex_);
  TeamMap map = fuse_chunks(chunks_.placed(), voxel_m_);
  if (!palette_.classes().empty() && !map.mesh.labels.empty()) map.mesh.colour_by(palette_);
  return map;
}

}  // namespace km
