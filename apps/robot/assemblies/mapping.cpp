#include "apps/robot/assemblies/mapping.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/robot/results.hpp"
#include "modules/dense_sensing/node/dense_sensing_node.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/objects/node/objects_codec.hpp"
#include "modules/semantic_mapping/node/semantic_mapping_node.hpp"

namespace km {

Mapping::Mapping(RobotCore& core, const RobotOptions& options, const RobotConfig& config,
                 const std::optional<MappingPlan>& plan, const std::optional<StereoRig>& rig,
                 std::optional<ResumedMap> before, ResultWriter& results)
    : core_(core) {
  if (plan && rig) add_mapper(config, options.pace.waits, *rig, *plan, std::move(before));
  if (plan) add_corrected(config, options.output, plan->palette, results);
  if (plan && !plan->palette.classes().empty() && config.objects.on)
    add_objects(config.objects, options.output, plan->palette, results);
  share(config.map, plan ? plan->palette : LabelPalette());
}

// A mapper that is too slow skips frames. If the recording waits, no frame is late, and the mapper
// holds the other nodes up, so that the map does not depend on the machine.
void Mapping::add_mapper(const RobotConfig& config, bool waits, const StereoRig& rig,
                         const MappingPlan& plan, std::optional<ResumedMap> before) {
  const Overflow overflow = waits ? Overflow::kBlock : Overflow::kDropOldest;
  SemanticMappingConfig map = config.semantic_mapping;
  if (!map.depth_sigma_per_m) map.depth_sigma_per_m = depth_sigma_per_m(rig, plan);
  if (*map.depth_sigma_per_m > 0.0)
    map.max_range_m = std::min(
        map.max_range_m, std::sqrt(config.mapping.max_depth_error_m / *map.depth_sigma_per_m));
  DenseSensor sensor(rig, plan.sensor);
  const Camera camera = sensor.camera();
  Topics& t = core_.topics;
  core_.nodes.add_feeding<DenseSensingNode>(
      std::move(sensor), plan.sensor.labels, config.mapping.rate_hz, overflow,
      DenseSensingTopics{.located = t.located_frames,
                         .load = t.shed_load,
                         .frames = t.dense_frames,
                         .progress = t.dense_sensing_progress});
  auto& mapper = core_.nodes.add_feeding<SemanticMappingNode>(
      map, camera, plan.palette, config.mapping.mesh_interval_s, overflow,
      SemanticMappingTopics{.frames = t.dense_frames,
                            .superseded = t.superseded_surface,
                            .maps = t.maps,
                            .progress = t.mapping_progress});
  if (before) mapper.continue_from(*std::move(before));
  ray_thinner_.emplace(camera, map.max_range_m);
}

void Mapping::add_corrected(const RobotConfig& config, const std::filesystem::path& folder,
                            const LabelPalette& palette, ResultWriter& results) {
  Topics& t = core_.topics;
  mesh_deformation_ = &core_.nodes.add<MeshDeformationNode>(
      config.mesh_deformation, core_.identity.robot,
      MeshDeformationTopics{.maps = t.maps,
                            .keyframes = t.keyframe_odometry,
                            .trajectory = t.trajectory,
                            .optimized = t.optimized_meshes,
                            .superseded = t.superseded_surface});
  if (config.map_2d.enabled && ray_thinner_) {
    auto& map = core_.nodes.add<Map2dNode>(
        config.map_2d, palette, *std::exchange(ray_thinner_, std::nullopt),
        Map2dTopics{.frames = t.dense_frames, .maps = t.maps_2d});
    t.optimized_meshes.subscribe([&map](const auto& optimized) {
      map.offer({{optimized, &optimized->mesh}, optimized->T_world_odom, optimized->anchor});
    });
  }
  // After the nodes that it writes for: nodes stop in the order in which they are added.
  files_ = &core_.nodes.add<MeshFilesNode>(folder, results,
                                           MeshFilesTopics{.keyframes = t.keyframe_odometry,
                                                           .trajectory = t.trajectory,
                                                           .maps = t.maps,
                                                           .optimized = t.optimized_meshes,
                                                           .maps_2d = t.maps_2d});
}

void Mapping::add_objects(const ObjectsConfig& config, const std::filesystem::path& folder,
                          const LabelPalette& palette, ResultWriter& results) {
  Topics& t = core_.topics;
  objects_ = &core_.nodes.add<ObjectsNode>(config, core_.identity.robot, palette,
                                           ObjectsTopics{.meshes = t.optimized_meshes,
                                                         .trajectory = t.trajectory,
                                                         .received = t.objects.from_peers(),
                                                         .own = t.sent_objects,
                                                         .joint = t.joint_objects});
  forward<RobotObjects>(t.sent_objects, t.objects.to_peers());
  t.joint_objects.subscribe([this, folder, &results](const auto& objects) {
    write_objects(folder, *objects, objects_->palette(), results);
  });
  t.keyframes.subscribe([this](const auto& keyframe) { objects_->learn(keyframe->odometry); });
  constellations_ = &core_.nodes.add<ConstellationsNode>(
      core_.identity.robot, ConstellationsTopics{.own_objects = t.sent_objects,
                                                 .peer_objects = t.objects.from_peers(),
                                                 .closures = t.closures,
                                                 .restarts = t.closure_restarts,
                                                 .found = t.new_closures,
                                                 .outcomes = t.outcomes});
}

// A robot without a map only receives those of the others.
void Mapping::share(const MapSharingConfig& config, const LabelPalette& palette) {
  using enum TopicKind;
  using enum TrafficCategory;
  Topics& t = core_.topics;
  const bool receives = config.team != TeamMapMode::kOff;
  const bool sends = receives && mesh_deformation_ != nullptr;
  const bool has_objects = objects_ != nullptr;
  core_.bridge->exchange(t.chunks, kState, kMap, {.send = sends, .receive = receives});
  core_.bridge->exchange(t.mesh_poses, kState, kMap, {.send = sends, .receive = receives});
  core_.bridge->exchange(t.objects, kState, kMap, {.send = has_objects, .receive = has_objects});
  if (!receives) return;
  team_map_ = &core_.nodes.add<TeamMapNode>(
      palette, TeamMapTopics{.own_chunks = t.sent_chunks,
                             .received_chunks = t.chunks.from_peers(),
                             .own_poses = t.sent_mesh_poses,
                             .received_poses = t.mesh_poses.from_peers()});
  if (!sends) return;
  forward<MeshChunk>(t.sent_chunks, t.chunks.to_peers());
  forward<MeshPoses>(t.sent_mesh_poses, t.mesh_poses.to_peers());
  MeshChunksNode::Reduction reduction;
  if (config.team == TeamMapMode::kCoarse)
    reduction = [voxel_m = config.coarse_voxel_m](const LabelledMesh& mesh) {
      return resampled(mesh, voxel_m);
    };
  chunks_ = &core_.nodes.add<MeshChunksNode>(config, core_.identity.robot,
                                             MeshChunksTopics{t.sent_chunks, t.sent_mesh_poses},
                                             std::move(reduction));
  // A leaving robot corrects its mesh once more, from scratch. Other robots may have left before,
  // so all keep the chunks that they have.
  t.optimized_meshes.subscribe([this](const auto& optimized) {
    if (core_.phase == RobotPhase::kLeaving) return;
    chunks_->offer(optimized->anchor, {optimized, &optimized->mesh},
                   {optimized, &optimized->origin});
  });
}

}  // namespace km
