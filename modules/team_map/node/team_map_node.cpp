#include "modules/team_map/node/team_map_node.hpp"

#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

// Larger than the number of messages that can arrive while a mesh is fused, so that no sender
// waits.
constexpr std::size_t kQueue = 4096;

}  // namespace

TeamMapNode::TeamMapNode(LabelPalette palette, const TeamMapTopics& topics)
    : WorkerNode({.name = "team_map", .queue = kQueue, .in_background = true}),
      palette_(std::move(palette)) {
  follow(topics.own_chunks, topics.received_chunks, topics.own_poses, topics.received_poses);
}

void TeamMapNode::handle(const Input& input) {
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
  TeamMap map = fuse_chunks(chunks_.placed());
  if (map.mesh.colors.empty() && !palette_.classes().empty() && !map.mesh.labels.empty())
    map.mesh.colour_by(palette_);
  return map;
}

}  // namespace km
