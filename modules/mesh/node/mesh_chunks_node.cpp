#include "modules/mesh/node/mesh_chunks_node.hpp"

#include <string>
#include <utility>

#include "modules/mesh/mesh_chunks.hpp"
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

// Unused budget is kept for this time.
constexpr double kBurst_s = 0.5;

TokenBucket full_budget(double bytes_per_s) {
  return {bytes_per_s, kBurst_s * bytes_per_s, kBurst_s * bytes_per_s};
}

}  // namespace

MeshChunksNode::MeshChunksNode(const MapSharingConfig& config, RobotId self, Out<MeshChunk> chunks,
                               Reduction reduction)
    : config_(checked(config)),
      self_(self),
      chunks_(chunks),
      reduction_(std::move(reduction)),
      schedule_(config.min_move_m),
      budget_bytes_(full_budget(config.max_bytes_per_s)),
      worker_(
          kQueue, Overflow::kBlock, [this](const Offer& offer) { step(offer, steady_now_s()); },
          "mesh_chunks"),
      ticks_(
          steady_duration(kTick_s), [this] { worker_.post({}); }, "chunks tick") {}

void MeshChunksNode::offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh,
                           std::shared_ptr<const MeshOrigin> origin) {
  ++offers_;
  worker_.post({anchor, std::move(mesh), std::move(origin)});
}

void MeshChunksNode::learn(const OdometryPose& keyframe) {
  worker_.post({.mesh = nullptr, .keyframe = keyframe});
}

void MeshChunksNode::start() {
  worker_.start();
  ticks_.start();
}

void MeshChunksNode::stop() noexcept {
  worker_.stop();
  ticks_.stop();
}

std::exception_ptr MeshChunksNode::error() const {
  return worker_.error() != nullptr ? worker_.error() : ticks_.error();
}

void MeshChunksNode::step(const Offer& offer, double now_s) {
  if (offer.keyframe) keyframes_.insert_or_assign(offer.keyframe->id.index, *offer.keyframe);
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
  waiting_ = schedule_.waiting();
  if (is_due) --offers_;
}

void MeshChunksNode::take(const Offer& offer) {
  SplitMesh pieces = split_mesh(reduction_ ? reduction_(*offer.mesh) : *offer.mesh, self_,
                                offer.anchor, {config_.cell_m, config_.position_step_m});
  if (pieces.oversized_faces > 0)
    log::limited(log::Level::kWarn, name(), "oversized")
        << pieces.oversized_faces
        << " faces are too long for map.position_step_m = " << config_.position_step_m
        << " m and are not sent";
  if (offer.origin != nullptr) state_keyframes(pieces.chunks, offer);
  schedule_.update(std::move(pieces.chunks));
}

void MeshChunksNode::state_keyframes(std::vector<MeshChunk>& chunks, const Offer& offer) const {
  const MeshOrigin& origin = *offer.origin;
  const auto of_cell = keyframes_of_cells(*offer.mesh, origin.seen_by, config_.cell_m);
  for (MeshChunk& chunk : chunks) {
    const auto index = of_cell.find(chunk.key.cell);
    if (index == of_cell.end() || index->second >= origin.T_world_kf.size()) continue;
    const auto keyframe = keyframes_.find(index->second);
    if (keyframe == keyframes_.end()) continue;
    chunk.keyframe = {keyframe->second, origin.T_world_kf[index->second]};
  }
}

// A chunk is sent while there is no debt. It may cause a debt.
void MeshChunksNode::send(double now_s) {
  while (budget_bytes_.wait_s(0.0, now_s) <= 0.0) {
    std::optional<MeshChunk> chunk = schedule_.next();
    if (!chunk) return;
    budget_bytes_.spend(static_cast<double>(wire_bytes(*chunk)), now_s);
    chunks_.publish(*std::move(chunk));
  }
}

}  // namespace km
