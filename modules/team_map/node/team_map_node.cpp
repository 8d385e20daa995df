#include "modules/team_map/node/team_map_node.hpp"

#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

// Larger than the number of chunks that can arrive while a mesh is fused, so that no sender waits.
constexpr std::size_t kQueue = 4096;

}  // namespace

TeamMapNode::TeamMapNode(double voxel_m, LabelPalette palette, In<MeshChunk> own,
                         In<MeshChunk> received)
    : voxel_m_(voxel_m),
      palette_(std::move(palette)),
      worker_(
          kQueue, Overflow::kBlock, [this](const auto& chunk) { take(*chunk); }, "team_map") {
  for (const In<MeshChunk>& chunks : {own, received})
    chunks.subscribe([this](const auto& chunk) { worker_.post(chunk); });
}

void TeamMapNode::take(const MeshChunk& chunk) {
  const std::lock_guard lock(mutex_);
  const ChunkVerdict verdict = chunks_.add(chunk);
  if (verdict != ChunkVerdict::kTaken)
    log::limited(log::Level::kWarn, name(), std::to_string(chunk.key.robot))
        << "a chunk of robot " << chunk.key.robot << "'s mesh is ignored: " << to_string(verdict);
}

TeamMap TeamMapNode::fuse() const {
  const std::lock_guard lock(mutex_);
  TeamMap map = fuse_chunks(chunks_.chunks(), voxel_m_);
  if (!palette_.classes().empty() && !map.mesh.labels.empty()) map.mesh.colour_by(palette_);
  return map;
}

}  // namespace km
