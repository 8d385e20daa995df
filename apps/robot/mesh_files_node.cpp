#include "apps/robot/mesh_files_node.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/result_files.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/map_2d/map_2d.hpp"
#include "modules/map_2d/map_server_files.hpp"
#include "modules/mesh/map_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/objects/object_file.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// The newest message of each kind is kept beside the queue, so one queued tick stands for all.
constexpr std::size_t kMeshQueue = 1;

// Writes a 2D map as Nav2's map_server reads it: the YAML file `name`, and its image.
void write_map_2d(const std::filesystem::path& folder, const char* name, const char* image,
                  const OccupancyGrid& map, ResultWriter& results) {
  results.write(folder / image, [&](const auto& file) { write_file(file, map_image(map)); });
  results.write(folder / name, [&](const auto& file) { write_file(file, map_yaml(map, image)); });
}

// Without the faces that leave the plan. Vertices outside are no numbers, which no grid contains.
LabelledMesh cropped(LabelledMesh mesh, const Eigen::AlignedBox2f& plan) {
  for (Eigen::Vector3f& vertex : mesh.vertices)
    if (!plan.contains(vertex.head<2>()))
      vertex.setConstant(std::numeric_limits<float>::quiet_NaN());
  std::erase_if(mesh.faces, [&](const LabelledMesh::Face& face) {
    return std::ranges::any_of(face, [&](auto v) { return std::isnan(mesh.vertices[v].x()); });
  });
  return mesh;
}

// The 2D map of the team is made of the fused mesh alone, so that all robots have the same.
void write_team_map_2d(const std::filesystem::path& folder, const Map2dConfig& config,
                       const TeamMap& team, const LabelPalette& palette, ResultWriter& results) {
  Map2dResult map = make_map_2d(config, {team.mesh, palette});
  if (map.status == Map2dStatus::kTooLarge) {
    const Eigen::AlignedBox2f plan = plan_of(team.extents, config.resolution_m, kMaxMap2dCells);
    map = make_map_2d(config, {cropped(team.mesh, plan), palette});
    for (const auto& [robot, extent] : team.extents)
      if (!plan.isEmpty() && !plan.contains({extent.min().head<2>(), extent.max().head<2>()}))
        log::warn("robot") << "the 2D map of the team lacks the part of robot " << robot
                           << ": with it, it has more than 16 million cells";
  }
  map.grid.anchor = team.anchor;
  if (map.status == Map2dStatus::kMade)
    return write_map_2d(folder, kTeamMap2d, kTeamMap2dImage, map.grid, results);
  log::warn("robot") << "no 2D map of the team: its mesh "
                     << (map.status == Map2dStatus::kEmpty ? "has no floor"
                                                           : "needs more than 16 million cells");
}

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
}

void MeshFilesNode::handle(const Tick& /*tick*/) {
  if (const auto keyframe = first_keyframe_.take()) T_odom_first_ = keyframe->T_odom_kf;
  if (const auto trajectory = trajectory_.take()) follow_first_pose(*trajectory);
  if (const auto map = latest_map_.take()) {
    map_ = map;
    write_map();
    write(kMapFile, [&](const auto& file) { write_map_file(file, *map); });
  }
  if (const auto mesh = optimized_.take())
    write("mesh_optimized.ply", [&](const auto& file) { write_mesh(file, mesh->mesh); });
  if (const auto map = map_2d_.take()) write_map_2d(folder_, kMap2d, kMap2dImage, *map, results_);
}

void MeshFilesNode::follow_first_pose(const Trajectory& trajectory) {
  if (!trajectory.T_world_kf.empty()) T_world_first_ = trajectory.T_world_kf.front();
}

void MeshFilesNode::finish(const std::optional<Trajectory>& trajectory) {
  if (trajectory) follow_first_pose(*trajectory);
  if (map_) write_map();
}

void MeshFilesNode::write_map() {
  LabelledMesh mesh = map_->mesh;
  if (T_world_first_ && T_odom_first_) mesh.transform(*T_world_first_ * T_odom_first_->inverse());
  write("mesh.ply", [&](const auto& file) { write_mesh(file, mesh); });
}

void write_objects(const std::filesystem::path& folder, const ObjectList& objects,
                   const LabelPalette& palette, ResultWriter& results) {
  results.write(folder / kObjectsFile,
                [&](const auto& file) { write_file(file, objects_json(objects, palette)); });
}

void write_team_map(const std::filesystem::path& folder, const Map2dConfig& config,
                    const TeamMapNode& node, ResultWriter& results) {
  log::info("robot") << "fusing the map of the team";
  const TeamMap map = node.fuse();
  results.write(folder / kTeamMesh, [&](const auto& file) { write_mesh(file, map.mesh); });
  if (config.enabled) write_team_map_2d(folder, config, map, node.palette(), results);
  log::info("robot") << "map of the team: " << map.mesh.faces.size()
                     << " faces, in the frame of robot " << map.anchor;
  if (map.other_frames > 0)
    log::warn("robot") << "the map of the team lacks " << map.other_frames
                       << " chunks in frames of robots that have not joined";
  if (map.left_out > 0)
    log::warn("robot") << "the map of the team lacks " << map.left_out << " boxes above "
                       << kMaxMapBoxes
                       << ": its voxels are too small, or a robot's map is too large";
}

}  // namespace km
