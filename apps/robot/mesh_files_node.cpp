#include "apps/robot/mesh_files_node.hpp"

#include <utility>

#include "modules/mesh/ply_file.hpp"
#include "runtime/background_thread.hpp"

namespace km {
namespace {

constexpr std::size_t kQueueCapacity = 1024;  // more than a robot publishes during one write

}  // namespace

MeshFilesNode::MeshFilesNode(std::filesystem::path folder, const MeshFilesTopics& topics)
    : folder_(std::move(folder)),
      worker_(
          kQueueCapacity, Overflow::kBlock,
          [this](const Input& input) {
            work_in_background();
            std::visit(
                [this](const auto& message) {
                  step(*message);
                  if constexpr (std::is_same_v<decltype(message),
                                               const std::shared_ptr<const MapMesh>&>)
                    map_ = message;
                },
                input);
          },
          "mesh_files") {
  take(topics.keyframes);
  take(topics.trajectory);
  take(topics.maps);
  take(topics.optimized);
}

void MeshFilesNode::step(const KeyframeOdometry& keyframe) {
  if (keyframe.id.index == 0) T_odom_first_ = keyframe.T_odom_kf;
}

void MeshFilesNode::step(const Trajectory& trajectory) {
  if (!trajectory.T_world_kf.empty()) T_world_first_ = trajectory.T_world_kf.front();
}

void MeshFilesNode::step(const MapMesh& map) {
  write_map(map.mesh);
}

void MeshFilesNode::step(const OptimizedMesh& mesh) {
  write_ply(folder_ / "mesh_optimized.ply", mesh.mesh);
}

void MeshFilesNode::finish(const std::optional<Trajectory>& trajectory) {
  if (trajectory) step(*trajectory);
  if (map_) write_map(map_->mesh);
}

void MeshFilesNode::write_map(const LabelledMesh& map) const {
  LabelledMesh mesh = map;
  if (T_world_first_ && T_odom_first_) mesh.transform(*T_world_first_ * T_odom_first_->inverse());
  write_ply(folder_ / "mesh.ply", mesh);
}

}  // namespace km
