#include "modules/mesh/team_mesh_node.hpp"

#include <string>

#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 4096;

}  // namespace

TeamMeshNode::TeamMeshNode(In<MeshChunk> chunks)
    : worker_(
          kQueue, Overflow::kBlock, [this](const auto& chunk) { take(*chunk); }, "team_mesh") {
  chunks.subscribe([this](const auto& chunk) { worker_.post(chunk); });
}

void TeamMeshNode::take(const MeshChunk& chunk) {
  const ChunkVerdict verdict = [&] {
    const std::lock_guard lock(mutex_);
    return team_.add(chunk);
  }();
  if (verdict != ChunkVerdict::kTaken)
    log::limited(log::Level::kWarn, name(), std::to_string(chunk.key.robot))
        << "a chunk of robot " << chunk.key.robot << "'s mesh is ignored: " << to_string(verdict);
}

std::vector<RobotMesh> TeamMeshNode::snapshot() const {
  const std::lock_guard lock(mutex_);
  return team_.snapshot();
}

}  // namespace km
