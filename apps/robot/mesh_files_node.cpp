#include "apps/robot/mesh_files_node.hpp"

#include <utility>

#include "apps/result_files.hpp"
#include "apps/robot/map_results.hpp"
#include "modules/mesh/map_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "runtime/thread.hpp"

namespace km {
namespace {

// The newest message of each kind is kept beside the queue, so one queued tick stands for all.
constexpr std::size_t kMeshQueue = 1;

}  // namespace

MeshFilesNode::MeshFilesNode(std::filesystem::path folder, ResultWriter& results,
                             const MeshFilesTopics& topics)
    // A disk may stall for long, and no other thread waits for this node.
    : WorkerNode({.name = "mesh_files",
                  .queue = kMeshQueue,
                  .overflow = Overflow::kDropOldest,
                  .in_background = true,
                  .step_limit_s = 300.0}),
      folder_(std::move(folder)),
      results_(results) {
  topics.keyframes.subscribe([this](const auto& keyframe) {
    if (keyframe->id.index == 0) first_keyframe_.put(keyframe);
  });
  topics.trajectory.subscribe([this](const auto& trajectory) { trajectory_.put(trajectory); });
  keep_newest(topics.maps, latest_map_);
  keep_newest(topics.optimized, optimized_);
  keep_newest(topics.maps_2d, map_2d_);
  keep_newest(topics.slices, slice_);
}

void MeshFilesNode::handle(const Tick& /*tick*/) {
  if (const auto keyframe = first_keyframe_.take()) step(*keyframe);
  if (const auto trajectory = trajectory_.take()) step(*trajectory);
  if (const auto map = latest_map_.take()) {
    step(*map);
    map_ = map;
  }
  if (const auto optimized = optimized_.take()) step(*optimized);
  if (const auto map = map_2d_.take()) step(*map);
  if (const auto slice = slice_.take()) step(*slice);
}

void MeshFilesNode::step(const KeyframeOdometry& keyframe) {
  if (keyframe.id.index == 0) T_odom_first_ = keyframe.T_odom_kf;
}

void MeshFilesNode::step(const Trajectory& trajectory) {
  if (!trajectory.T_world_kf.empty()) T_world_first_ = trajectory.T_world_kf.front();
}

void MeshFilesNode::step(const MapMesh& map) {
  write_map(map.mesh);
  results_.write(folder_ / kMapFile, [&map](const auto& file) { write_map_file(file, map); });
}

void MeshFilesNode::step(const OptimizedMesh& mesh) {
  results_.write(folder_ / "mesh_optimized.ply",
                 [&mesh](const auto& file) { write_mesh(file, mesh.mesh); });
}

void MeshFilesNode::step(const OccupancyGrid& map) {
  write_map_2d(folder_, kMap2d, kMap2dImage, map, results_);
}

void MeshFilesNode::step(const DistanceSlice& slice) {
  results_.write(folder_ / kDistanceSlice,
                 [&slice](const auto& file) { write_mesh(file, slice.points); });
}

void MeshFilesNode::finish(const std::optional<Trajectory>& trajectory) {
  if (trajectory) step(*trajectory);
  if (map_) write_map(map_->mesh);
}

void MeshFilesNode::write_map(const LabelledMesh& map) {
  LabelledMesh mesh = map;
  if (T_world_first_ && T_odom_first_) mesh.transform(*T_world_first_ * T_odom_first_->inverse());
  results_.write(folder_ / "mesh.ply", [&mesh](const auto& file) { write_mesh(file, mesh); });
}

}  // namespace km
