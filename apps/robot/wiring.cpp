#include "apps/robot/wiring.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/dense_sensing/dense_sensing_node.hpp"
#include "modules/loop_closure/keyframe_features_node.hpp"
#include "modules/loop_closure/loop_closure_codec.hpp"
#include "modules/loop_closure/loop_closure_node.hpp"
#include "modules/mesh/mesh_chunks_node.hpp"
#include "modules/mesh/mesh_codec.hpp"
#include "modules/outlier_rejection/outlier_rejection_codec.hpp"
#include "modules/outlier_rejection/pcm_node.hpp"
#include "modules/place_recognition/place_recognition_codec.hpp"
#include "modules/place_recognition/place_recognition_node.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/pose_graph/team_node.hpp"
#include "modules/semantic_mapping/semantic_mapping_node.hpp"
#include "modules/vio/vio_node.hpp"
#include "runtime/dds/robot_status_codec.hpp"

namespace km {

template <typename NodeType, typename... Arguments>
NodeType& Robot::add(bool feeds, Arguments&&... arguments) {
  NodeType& node = supervisor_.emplace<NodeType>(std::forward<Arguments>(arguments)...);
  if (feeds) feeding_.push_back(&node);
  nodes_.push_back(&node);
  return node;
}

Robot::Robot(const RobotOptions& options, const RobotConfig& config, RobotInput input,
             const std::optional<MappingPlan>& mapping, SignalWatch& signals)
    : identity_{.robot = options.robot, .name = options.name, .boot = random_boot_id()},
      participant_(config.dds, identity_),
      supervisor_(signals) {
  topics_.keyframe_odometry.subscribe([this](const auto& keyframe) {
    KeyframeOdometry pose = *keyframe;
    pose.frame = nullptr;
    topics_.keyframe_poses.publish(std::move(pose));
  });
  auto bridge = std::make_unique<DdsBridge>(participant_);
  bridge_ = bridge.get();
  if (auto* reader = std::get_if<std::unique_ptr<DatasetReader>>(&input))
    add_sensing(config, options.rate, std::move(*reader), mapping);
  else
    add_playback(config, options.rate, std::get<RecordedGraph>(std::move(input)));
  add_back_end(config);
  if (mapping) add_mesh_correction(config, options.output);
  share_meshes(config.mesh_chunks);
  add_network();
  add_records();
  nodes_.push_back(bridge_);
  supervisor_.add(std::move(bridge));
}

void Robot::add_sensing(const RobotConfig& config, double rate,
                        std::unique_ptr<DatasetReader> reader,
                        const std::optional<MappingPlan>& mapping) {
  const SensorRig rig = reader->rig();
  sensors_ = &add<SensorsNode>(true, config.sensors, rate, std::move(reader), topics_.packets,
                               topics_.sensors_end);
  add<VioNode>(true, identity_.robot, rig, config.tracker, config.vio,
               VioTopics{topics_.packets, topics_.odometry, topics_.keyframe_odometry,
                         topics_.located_frames});
  if (mapping) add_mapping(config, rate, rig.stereo, *mapping);
  add<KeyframeFeaturesNode>(true, config.keyframe_features, rig.stereo, topics_.keyframe_odometry,
                            topics_.keyframes);
  vocabulary_ =
      std::make_shared<const Vocabulary>(load_vocabulary(find_shipped_file(config.run.vocabulary)));
  add<PlaceRecognitionNode>(
      false, config.place_recognition, identity_.robot, vocabulary_,
      PlaceRecognitionTopics{topics_.keyframes, topics_.peer_bows, topics_.own_bows,
                             topics_.candidates, topics_.place_queries});
  topics_.sensors_end.subscribe([this](const auto&) { source_ended_ = true; });
}

// A mapper that is too slow leaves frames out; at --rate max, where no frame is late, it holds the
// others up, so that the map does not depend on the machine.
void Robot::add_mapping(const RobotConfig& config, double rate, const StereoRig& rig,
                        const MappingPlan& plan) {
  const Overflow overflow = std::isinf(rate) ? Overflow::kBlock : Overflow::kDropOldest;
  SemanticMappingConfig map = config.semantic_mapping;
  map.max_range_m =
      std::min(map.max_range_m, usable_range_m(rig, config.mapping.max_depth_error_m));
  DenseSensor sensor(rig, plan.sensor);
  const PinholeCamera camera = sensor.camera();
  add<DenseSensingNode>(true, std::move(sensor), plan.sensor.labels, config.mapping.rate_hz,
                        overflow,
                        DenseSensingTopics{topics_.located_frames, topics_.dense_frames,
                                           topics_.dense_sensing_progress});
  add<SemanticMappingNode>(true, map, camera, plan.palette, config.mapping.mesh_interval_s,
                           overflow,
                           SemanticMappingTopics{topics_.dense_frames, topics_.superseded_surface,
                                                 topics_.maps, topics_.mapping_progress});
}

void Robot::add_mesh_correction(const RobotConfig& config, const std::filesystem::path& folder) {
  mesh_deformation_ = &add<MeshDeformationNode>(
      false, config.mesh_deformation, identity_.robot,
      MeshDeformationTopics{topics_.maps, topics_.keyframe_poses, topics_.trajectory,
                            topics_.optimized_meshes, topics_.superseded_surface});
  mesh_files_ = &add<MeshFilesNode>(false, folder,
                                    MeshFilesTopics{topics_.keyframe_poses, topics_.trajectory,
                                                    topics_.maps, topics_.optimized_meshes});
}

// Others may hold the robot's map without having one themselves, and the other way round.
void Robot::share_meshes(const MeshChunksConfig& config) {
  if (config.publish && mesh_deformation_ != nullptr) {
    auto& chunks =
        add<MeshChunksNode>(false, config, identity_.robot, std::as_const(topics_.own_chunks));
    topics_.optimized_meshes.subscribe([&chunks](const auto& optimized) {
      chunks.offer(optimized->anchor, {optimized, &optimized->mesh});
    });
    bridge_->send(topics_.own_chunks, TopicKind::kState, TrafficCategory::kOther);
  }
  if (config.collect) {
    peer_meshes_ = &add<TeamMeshNode>(false, topics_.peer_chunks);
    bridge_->receive(topics_.peer_chunks, TopicKind::kState, TrafficCategory::kOther);
  }
}

void Robot::add_playback(const RobotConfig& config, double rate, RecordedGraph graph) {
  add<GraphPlaybackNode>(true, config.graph_playback, rate, std::move(graph),
                         GraphPlaybackTopics{topics_.keyframe_odometry, topics_.keyframes,
                                             topics_.measured_closures, topics_.playback_end});
  topics_.playback_end.subscribe([this](const auto&) { source_ended_ = true; });
}

void Robot::add_back_end(const RobotConfig& config) {
  add<LoopClosureNode>(
      false, config.loop_closure, identity_.robot, vocabulary_,
      LoopClosureTopics{topics_.keyframes, topics_.candidates, topics_.measured_closures,
                        topics_.peer_requests, topics_.peer_replies, bridge_->peers().events(),
                        topics_.peer_bows, topics_.own_requests, topics_.own_replies,
                        topics_.own_closures, topics_.outcomes});
  topics_.own_closures.subscribe(
      [this](const auto& closure) { topics_.closures.publish(closure); });
  pcm_ = &add<PcmNode>(false, config.pcm, identity_.robot, topics_.closures,
                       topics_.own_inlier_sets, &bridge_->peers().events());
  add<TeamNode>(false, config.pose_graph, TeamPeer{identity_.robot, identity_.boot},
                TeamTopics{topics_.keyframe_poses, topics_.closures, topics_.own_inlier_sets,
                           topics_.peer_inlier_sets, bridge_->peers().events(),
                           topics_.peer_parcels, topics_.own_parcels, topics_.trajectory,
                           topics_.progress, topics_.closure_verdicts});
}

// What crosses between robots, and how: the kinds of topic are those of runtime/dds/topic_kind.hpp.
void Robot::add_network() {
  using enum TopicKind;
  using enum TrafficCategory;
  DdsBridge& dds = *bridge_;
  Topics& t = topics_;
  dds.send(t.own_bows, kEvent, kPlaceRecognition);
  dds.receive(t.peer_bows, kEvent, kPlaceRecognition);
  dds.send(t.own_requests, kRequest, kGeometricVerification);
  dds.receive_addressed(t.peer_requests, kRequest, kGeometricVerification);
  dds.send(t.own_replies, kRequest, kGeometricVerification);
  dds.receive_addressed(t.peer_replies, kRequest, kGeometricVerification);
  // A closure, and whether it is an inlier, is of use to the robots it joins and to no others.
  t.own_closures.subscribe([&t](const auto& closure) {
    if (closure->to.id.robot != closure->from.id.robot)
      t.closures_to_peers.publish(Addressed<Closure>{closure->to.id.robot, closure});
  });
  dds.send(t.closures_to_peers, kEvent, kGeometricVerification);
  dds.receive_addressed(t.closures, kEvent, kGeometricVerification);
  t.own_inlier_sets.subscribe([&t](const auto& set) {
    if (set->a != set->b) t.inlier_sets_to_peers.publish(Addressed<InlierSet>{set->b, set});
  });
  dds.send(t.inlier_sets_to_peers, kState, kPoseGraphOptimization);
  dds.receive_addressed(t.peer_inlier_sets, kState, kPoseGraphOptimization);
  dds.send(t.own_parcels, kRequest, kPoseGraphOptimization);
  dds.receive_addressed(t.peer_parcels, kRequest, kPoseGraphOptimization);
  dds.send(t.own_status, kStatus, kOther);
  dds.receive(t.peer_status, kStatus, kOther);
  dds.peers().events().subscribe([this](const auto& event) {
    if (event->kind == PeerEventKind::kConflict && event->identity.robot == identity_.robot)
      id_taken_ = true;
  });
}

void Robot::add_records() {
  recorder_ = &add<RecorderNode>(false, identity_.robot);
  recorder_->record(topics_.odometry);
  recorder_->record(topics_.keyframe_poses);
  recorder_->record(topics_.keyframes);
  recorder_->record(topics_.closures);
  recorder_->record(topics_.outcomes);
  recorder_->record(topics_.own_inlier_sets);
  recorder_->record(topics_.peer_inlier_sets);
  recorder_->record(topics_.trajectory);
  recorder_->record(topics_.progress);
  recorder_->record(topics_.closure_verdicts);
  recorder_->record(topics_.dense_sensing_progress);
  recorder_->record(topics_.mapping_progress);
  recorder_->record(topics_.maps);
  recorder_->record(topics_.optimized_meshes);
  // The first stamp is the origin of the dataset's time shown to people.
  topics_.keyframe_odometry.subscribe(
      [this, first = std::optional<Stamp>()](const auto& keyframe) mutable {
        if (!first) first = keyframe->stamp;
        dataset_time_s_ = seconds_between(*first, keyframe->stamp);
        ++keyframes_;
      });
  status_ = &add<RobotStatusNode>(
      false, [this] { return own_status(); }, topics_.own_status, topics_.peer_status);
}

RobotStatus Robot::own_status() const {
  return {identity_.robot, identity_.name, phase_, dataset_time_s_, keyframes_, settled_links_};
}

void Robot::freeze_record() {
  recorder_->freeze();
  if (mesh_deformation_ != nullptr) mesh_deformation_->finish();
}

bool Robot::input_ended() {
  if (!source_ended_) return false;
  if (!std::exchange(drained_, true))
    for (Node* node : feeding_) node->stop();
  return true;
}

}  // namespace km
