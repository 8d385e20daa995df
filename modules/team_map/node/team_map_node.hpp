#pragma once

#include <mutex>
#include <variant>

#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "modules/team_map/team_map.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of TeamMapNode; they must outlive it. `own`: messages that this robot has sent;
/// `received`: those of the other robots.
struct TeamMapTopics {
  In<MeshChunk> own_chunks, received_chunks;
  In<MeshPoses> own_poses, received_poses;
};

/// Stores the chunks and poses of all robots, and fuses them into one mesh when it is asked for.
class TeamMapNode final
    : public WorkerNode<std::variant<Topic<MeshChunk>::Message, Topic<MeshPoses>::Message>> {
 public:
  /// `palette` colours the mesh, if it has classes.
  TeamMapNode(LabelPalette palette, const TeamMapTopics& topics);
  ~TeamMapNode() override { stop(); }

  [[nodiscard]] const LabelPalette& palette() const { return palette_; }

  /// Fuses all chunks so far and colours the mesh; takes seconds for a large map.
  /// Thread-safe.
  [[nodiscard]] TeamMap fuse() const;

 private:
  void handle(const Input& input) override;

  const LabelPalette palette_;
  mutable std::mutex mutex_;  // guards chunks_
  TeamMesh chunks_;
};

}  // namespace km
