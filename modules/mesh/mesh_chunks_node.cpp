#include "modules/mesh/mesh_chunks_node.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "modules/mesh/mesh_chunks.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Longer than cutting up a mesh takes to be through: nobody waits for it.
constexpr std::size_t kQueue = 4096;

// Chunks leave in small bursts: what may pass between two ticks.
constexpr double kTick_s = 0.1;

// Unused budget is kept this long, at least one chunk's worth.
constexpr double kBurst_s = 0.5;

}  // namespace

MeshChunksNode::MeshChunksNode(const MeshChunksConfig& config, RobotId self, Out<MeshChunk> chunks)
    : config_(checked(config)),
      self_(self),
      chunks_(chunks),
      schedule_(config.min_move_m),
      worker_(
          kQueue, Overflow::kBlock, [this](const Offer& offer) { step(offer, steady_now_s()); },
          MeshChunksConfig::kSection),
      ticks_(
          steady_duration(kTick_s), [this] { worker_.post({}); }, "chunks tick") {}

void MeshChunksNode::offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh) {
  worker_.post({anchor, std::move(mesh)});
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
  if (offer.mesh != nullptr) take(offer);
  send(now_s);
  waiting_ = schedule_.waiting();
}

void MeshChunksNode::take(const Offer& offer) {
  MeshPieces pieces =
      split_mesh(*offer.mesh, self_, offer.anchor, {config_.cell_m, config_.position_step_m});
  if (pieces.oversized_faces > 0)
    log::limited(log::Level::kWarn, name(), "oversized")
        << pieces.oversized_faces
        << " faces are too long for mesh_chunks.position_step_m = " << config_.position_step_m
        << " m and are not sent";
  schedule_.update(std::move(pieces.chunks));
}

// A token bucket: a chunk leaves when the budget is above zero, and may overdraw it once.
void MeshChunksNode::send(double now_s) {
  const double most = std::max(kBurst_s * config_.max_bytes_per_s, 1.0);
  if (std::exchange(budget_started_, true))
    budget_bytes_ += (now_s - budget_time_s_) * config_.max_bytes_per_s;
  else
    budget_bytes_ = most;
  budget_bytes_ = std::min(budget_bytes_, most);
  budget_time_s_ = now_s;
  while (budget_bytes_ > 0.0) {
    std::optional<MeshChunk> chunk = schedule_.next();
    if (!chunk) return;
    budget_bytes_ -= static_cast<double>(wire_bytes(*chunk));
    chunks_.publish(*std::move(chunk));
  }
}

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
