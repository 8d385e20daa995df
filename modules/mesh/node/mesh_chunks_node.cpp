#include "modules/mesh/node/mesh_chunks_node.hpp"

#include <utility>

#include "modules/mesh/chunk_packing.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Larger than the number of meshes that can arrive while one is split, so that no sender waits.
constexpr std::size_t kQueue = 4096;

// Chunks are sent in small bursts, each with the budget of one tick.
constexpr double kTick_s = 0.1;

// Pause after a mesh is reduced and split, as a multiple of the time that this takes. Whatever the
// size of the mesh, the work takes less than a tenth of a processor.
constexpr double kPauses = 10.0;

// Poses take at most this share of the budget, because each message states all of them.
constexpr double kPosesShare = 0.1;

// Poses are sent when they move surface by this share of kMinChunkMove_m. A chunk that was sent
// with newer poses may lie this far from its neighbours until the next poses.
constexpr double kPosesMove = 0.5;

// Unused budget is kept for this time.
constexpr double kBurst_s = 0.5;

TokenBucket full_budget(double bytes_per_s) {
  return {bytes_per_s, kBurst_s * bytes_per_s, kBurst_s * bytes_per_s};
}

}  // namespace

MeshChunksNode::MeshChunksNode(const MapSharingConfig& config, RobotId self,
                               const MeshChunksTopics& topics, Reduction reduction)
    : WorkerNode({.name = "mesh_chunks", .queue = kQueue, .tick_s = kTick_s}),
      config_(checked(config)),
      self_(self),
      topics_(topics),
      reduction_(std::move(reduction)),
      schedule_(kMinChunkMove_m),
      sent_poses_{.robot = self},
      budget_bytes_(full_budget(config.max_bytes_per_s)) {}

void MeshChunksNode::offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh,
                           std::shared_ptr<const MeshOrigin> origin) {
  ++offers_;
  post({anchor, std::move(mesh), std::move(origin)});
}

void MeshChunksNode::step(const MeshOffer& offer, double now_s) {
  if (offer.mesh != nullptr) {
    if (newest_.mesh != nullptr) --offers_;
    newest_ = offer;
  }
  const bool is_due = newest_.mesh != nullptr && now_s >= next_take_s_;
  if (is_due) {
    const double start_s = steady_now_s();
    take(newest_);
    newest_ = {};
    next_take_s_ = now_s + kPauses * (steady_now_s() - start_s);
  }
  send(now_s);
  waiting_ = schedule_.waiting() + (waiting_poses_ ? 1 : 0);
  if (is_due) --offers_;
}

void MeshChunksNode::take(const MeshOffer& offer) {
  SplitMesh pieces = split(offer);
  if (pieces.oversized_faces > 0)
    log::limited(log::Level::kWarn, name(), "oversized")
        << pieces.oversized_faces << " faces are longer than 21 m and are not sent";
  if (reduction_ || offer.origin == nullptr) return schedule_.update(std::move(pieces.chunks));
  const MeshPoses poses{.robot = self_,
                        .anchor = offer.anchor,
                        .keyframes = mesh_keyframes(offer.origin->T_world_kf)};
  schedule_.update(std::move(pieces.chunks), &poses);
  waiting_poses_.reset();
  if (has_moved(sent_poses_, poses, kPosesMove * kMinChunkMove_m)) waiting_poses_ = poses;
}

SplitMesh MeshChunksNode::split(const MeshOffer& offer) const {
  if (reduction_) {
    SplitMesh pieces = split_mesh(reduction_(*offer.mesh), self_, offer.anchor, {});
    for (MeshChunk& chunk : pieces.chunks)
      chunk.voxel_m = static_cast<float>(config_.coarse_voxel_m);
    return pieces;
  }
  return split_mesh(*offer.mesh, self_, offer.anchor, {}, offer.origin.get());
}

// A message is sent while there is no debt. It may cause a debt.
void MeshChunksNode::send(double now_s) {
  send_poses(now_s);
  while (budget_bytes_.wait_s(0.0, now_s) <= 0.0) {
    const std::optional<MeshChunk> chunk = schedule_.next();
    if (!chunk) return;
    MeshChunk sent = sorted_in_space(*chunk);
    budget_bytes_.spend(static_cast<double>(wire_bytes(sent)), now_s);
    topics_.chunks.publish(std::move(sent));
  }
}

void MeshChunksNode::send_poses(double now_s) {
  if (!waiting_poses_ || now_s < next_poses_s_ || budget_bytes_.wait_s(0.0, now_s) > 0.0) return;
  const auto bytes = static_cast<double>(wire_bytes(*waiting_poses_));
  budget_bytes_.spend(bytes, now_s);
  next_poses_s_ = now_s + bytes / (kPosesShare * config_.max_bytes_per_s);
  sent_poses_ = *std::exchange(waiting_poses_, std::nullopt);
  topics_.poses.publish(sent_poses_);
}

}  // namespace km
