#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "modules/mesh/chunk_schedule.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/map_sharing_config.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_origin.hpp"
#include "modules/mesh/mesh_poses.hpp"
#include "runtime/token_bucket.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of MeshChunksNode; they must outlive it.
struct MeshChunksTopics {
  Out<MeshChunk> chunks;
  Out<MeshPoses> poses;
};

/// A mesh in the frame `world` of the robot `anchor`, with the keyframes that saw it, if known. A
/// null mesh is a tick of the clock.
struct MeshOffer {
  RobotId anchor = 0;
  std::shared_ptr<const LabelledMesh> mesh;
  std::shared_ptr<const MeshOrigin> origin = {};
};

/// Publishes the robot's mesh in chunks, at most max_bytes_per_s on average. Only chunks that have
/// changed since they were last sent are sent, each in its newest version. The module that has the
/// robot's best mesh passes it to offer().
///
/// A correction of the trajectory moves chunks by the poses of their keyframes, which take at most
/// a tenth of the bytes. They are sent when they move some surface by more than half of
/// kMinChunkMove_m, and when keyframes were added.
class MeshChunksNode final : public WorkerNode<MeshOffer> {
 public:
  /// Reduces a mesh before it is sent.
  using Reduction = std::function<LabelledMesh(const LabelledMesh&)>;

  /// Throws ConfigError if `config` is out of bounds. Without a reduction the whole mesh is sent.
  /// The chunks of a reduced mesh have no keyframes, because it has no origin.
  MeshChunksNode(const MapSharingConfig& config, RobotId self, const MeshChunksTopics& topics,
                 Reduction reduction = {});
  ~MeshChunksNode() override { stop(); }

  /// Only the newest mesh counts. Thread-safe; returns at once.
  void offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh,
             std::shared_ptr<const MeshOrigin> origin = {});

  /// Number of waiting chunks, and one for waiting poses. Thread-safe.
  [[nodiscard]] std::size_t waiting() const { return waiting_; }
  /// True once all chunks of the offered meshes and their poses are sent. Thread-safe.
  [[nodiscard]] bool is_done() const { return waiting_ == 0 && offers_ == 0; }

  /// Handles one offer synchronously at time `now_s`. The thread calls only this function; tests
  /// can call it too.
  void step(const MeshOffer& offer, double now_s);

 private:
  void handle(const MeshOffer& offer) override { step(offer, steady_now_s()); }
  void take(const MeshOffer& offer);
  [[nodiscard]] SplitMesh split(const MeshOffer& offer) const;
  void send(double now_s);
  void send_poses(double now_s);

  const MapSharingConfig config_;
  const RobotId self_;
  const MeshChunksTopics topics_;
  const Reduction reduction_;
  ChunkSchedule schedule_;
  MeshPoses sent_poses_;
  std::optional<MeshPoses> waiting_poses_;
  double next_poses_s_ = 0.0;
  TokenBucket budget_bytes_;
  std::atomic<std::size_t> waiting_ = 0;  // chunks and poses
  std::atomic<int> offers_ = 0;           // meshes that are neither split nor replaced
  MeshOffer newest_;                      // the mesh to be split next, if any
  double next_take_s_ = 0.0;
};

}  // namespace km
