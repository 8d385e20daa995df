#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/robot/wiring.hpp"
#include "modules/dense_sensing/node/dense_sensing_node.hpp"
#include "modules/semantic_mapping/node/semantic_mapping_node.hpp"

// The modules of the map: of this robot, and of the team.

namespace km {

// A mapper that is too slow skips frames. If the recording waits, no frame is late, and the mapper
// holds the other nodes up, so that the map does not depend on the machine.
void Robot::add_mapping(const RobotConfig& config, const PlaybackPace& pace, const StereoRig& rig,
                        const MappingPlan& plan, std::optional<ResumedMap> before) {
  const Overflow overflow = pace.waits ? Overflow::kBlock : Overflow::kDropOldest;
  SemanticMappingConfig map = config.semantic_mapping;
  if (!map.depth_sigma_per_m) map.depth_sigma_per_m = depth_sigma_per_m(rig, plan);
  if (*map.depth_sigma_per_m > 0.0)
    map.max_range_m = std::min(
        map.max_range_m, std::sqrt(config.mapping.max_depth_error_m / *map.depth_sigma_per_m));
  DenseSensor sensor(rig, plan.sensor);
  const Camera camera = sensor.camera();
  add<DenseSensingNode>(true, std::move(sensor), plan.sensor.labels, config.mapping.rate_hz,
                        overflow,
                        DenseSensingTopics{.located = topics_.located_frames,
                                           .load = topics_.shed_load,
                                           .frames = topics_.dense_frames,
                                           .progress = topics_.dense_sensing_progress});
  auto& mapper = add<SemanticMappingNode>(
      true, map, camera, plan.palette, config.mapping.mesh_interval_s, overflow,
      SemanticMappingTopics{.frames = topics_.dense_frames,
                            .superseded = topics_.superseded_surface,
                            .maps = topics_.maps,
                            .progress = topics_.mapping_progress});
  if (before) mapper.continue_from(*std::move(before));
  ray_thinner_.emplace(camera, map.max_range_m);
}

void Robot::add_mesh_correction(const RobotConfig& config) {
  mesh_deformation_ =
      &add<MeshDeformationNode>(false, config.mesh_deformation, identity_.robot,
                                MeshDeformationTopics{.maps = topics_.maps,
                                                      .keyframes = topics_.keyframe_odometry,
                                                      .trajectory = topics_.trajectory,
                                                      .optimized = topics_.optimized_meshes,
                                                      .superseded = topics_.superseded_surface});
}

void Robot::add_map_2d(const Map2dConfig& config, const LabelPalette& palette) {
  auto& map = add<Map2dNode>(false, config, palette, *std::exchange(ray_thinner_, std::nullopt),
                             Map2dTopics{.frames = topics_.dense_frames, .maps = topics_.maps_2d});
  topics_.optimized_meshes.subscribe([&map](const auto& optimized) {
    map.offer({{optimized, &optimized->mesh}, optimized->T_world_odom, optimized->anchor});
  });
}

// Call after the nodes that it writes for: nodes stop in the order in which they are added.
void Robot::add_mesh_files(const std::filesystem::path& folder, ResultWriter& results) {
  mesh_files_ = &add<MeshFilesNode>(false, folder, results,
                                    MeshFilesTopics{.keyframes = topics_.keyframe_odometry,
                                                    .trajectory = topics_.trajectory,
                                                    .maps = topics_.maps,
                                                    .optimized = topics_.optimized_meshes,
                                                    .maps_2d = topics_.maps_2d});
}

// A robot without a map only receives the meshes of the others.
CrossingEnds Robot::share_meshes(const RobotConfig& robot, const LabelPalette& palette) {
  const MapSharingConfig& config = robot.map;
  if (config.team == TeamMapMode::kOff) return {.send = false, .receive = false};
  team_map_ = &add<TeamMapNode>(false, palette,
                                TeamMapTopics{.own_chunks = topics_.sent_chunks,
                                              .received_chunks = topics_.chunks.from_peers(),
                                              .own_poses = topics_.sent_mesh_poses,
                                              .received_poses = topics_.mesh_poses.from_peers()});
  if (mesh_deformation_ == nullptr) return {.send = false, .receive = true};
  forward<MeshChunk>(topics_.sent_chunks, topics_.chunks.to_peers());
  forward<MeshPoses>(topics_.sent_mesh_poses, topics_.mesh_poses.to_peers());
  MeshChunksNode::Reduction reduction;
  if (config.team == TeamMapMode::kCoarse)
    reduction = [voxel_m = config.coarse_voxel_m](const LabelledMesh& mesh) {
      return resampled(mesh, voxel_m);
    };
  chunks_ = &add<MeshChunksNode>(false, config, identity_.robot,
                                 MeshChunksTopics{topics_.sent_chunks, topics_.sent_mesh_poses},
                                 std::move(reduction));
  // A leaving robot corrects its mesh once more, from scratch. Other robots may have left before,
  // so all keep the chunks that they have.
  topics_.optimized_meshes.subscribe([this](const auto& optimized) {
    if (phase_ == RobotPhase::kLeaving) return;
    chunks_->offer(optimized->anchor, {optimized, &optimized->mesh},
                   {optimized, &optimized->origin});
  });
  return {};
}

void Robot::add_objects(const ObjectsConfig& config, const LabelPalette& palette,
                        const std::filesystem::path& folder, ResultWriter& results) {
  objects_ = &add<ObjectsNode>(false, config, identity_.robot, palette,
                               ObjectsTopics{.meshes = topics_.optimized_meshes,
                                             .trajectory = topics_.trajectory,
                                             .received = topics_.objects.from_peers(),
                                             .own = topics_.sent_objects,
                                             .joint = topics_.joint_objects});
  forward<RobotObjects>(topics_.sent_objects, topics_.objects.to_peers());
  topics_.joint_objects.subscribe([this, folder, &results](const auto& objects) {
    write_objects(folder, *objects, objects_->palette(), results);
  });
  topics_.keyframes.subscribe(
      [this](const auto& keyframe) { objects_->learn(keyframe->odometry); });
  constellations_ =
      &add<ConstellationsNode>(false, identity_.robot,
                               ConstellationsTopics{.own_objects = topics_.sent_objects,
                                                    .peer_objects = topics_.objects.from_peers(),
                                                    .closures = topics_.closures,
                                                    .restarts = topics_.closure_restarts,
                                                    .found = topics_.new_closures,
                                                    .outcomes = topics_.outcomes});
}

}  // namespace km
