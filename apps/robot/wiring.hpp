#pragma once

#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/robot/journal_node.hpp"
#include "apps/robot/mesh_files_node.hpp"
#include "apps/robot/robot_config.hpp"
#include "apps/robot/robot_input.hpp"
#include "apps/robot/run_end.hpp"
#include "apps/robot/run_record.hpp"
#include "apps/robot/status.hpp"
#include "modules/absolute_fixes/node/fixes_node.hpp"
#include "modules/constellations/node/constellations_node.hpp"
#include "modules/core/closure_verdicts.hpp"
#include "modules/core/dense_frame.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/processing_load.hpp"
#include "modules/core/tracked_image.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/localization/node/localization_node.hpp"
#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/map_2d/node/map_2d_node.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh/node/mesh_chunks_node.hpp"
#include "modules/mesh_deformation/node/mesh_deformation_node.hpp"
#include "modules/objects/node/objects_node.hpp"
#include "modules/outlier_rejection/node/pcm_node.hpp"
#include "modules/place_recognition/bag_of_words.hpp"
#include "modules/place_recognition/place_database.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "modules/recorded_graph/node/graph_playback_node.hpp"
#include "modules/ros_dds/node/ros_output_node.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/sensors/node/sensors_node.hpp"
#include "modules/session/team_messages.hpp"
#include "modules/team_map/node/team_map_node.hpp"
#include "modules/view/node/view_node.hpp"
#include "modules/vio/node/vio_node.hpp"
#include "runtime/dds/bridge.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/overlay/overlay_node.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// Messages to single robots, in range or not. OverlayNode connects the three.
template <typename T>
struct TeamChannel {
  Topic<Addressed<T>> own;      ///< From the nodes of this robot.
  AddressedCrossing<T> direct;  ///< Between robots in range.
  Topic<T> received;            ///< From robots in range and out of range.

  [[nodiscard]] RelayedTopics<T> ends() {
    return {own, direct.to_peers(), direct.from_peers(), received};
  }
};

/// Every channel of a robot. Only Crossing and TeamChannel leave the process.
struct Topics {
  Topic<SensorPacket> packets;
  Topic<ProcessedFrame> processed_frames;
  Topic<ShedLoad> shed_load;
  Topic<OdometryState> odometry, restored_odometry;
  Topic<KeyframeOdometry> keyframe_odometry;
  Topic<Keyframe> new_keyframes, keyframes;  // keyframes: only those that are on the disk
  Topic<LocatedFrame> located_frames;
  Topic<VioStatistics> odometry_statistics;
  Topic<TrackedImage> tracked_images;
  Topic<DenseFrame> dense_frames;
  Topic<DenseSensingProgress> dense_sensing_progress;
  Topic<MapMesh> maps;
  Topic<OptimizedMesh> optimized_meshes;
  Topic<SupersededSurface> superseded_surface;
  Topic<ObjectList> joint_objects;
  Topic<OccupancyGrid> maps_2d;
  Topic<MappingProgress> mapping_progress;
  Topic<RelativePose> measured_closures;
  Topic<PlaceQuery> place_queries;
  Topic<LoopCandidate> candidates;
  Topic<PeerEvent> candidate_restarts, new_closure_restarts,
      closure_restarts;  // points at which candidates and closures restart
  Topic<ClosureOutcome> outcomes, restored_outcomes;
  // new_closures: found by this robot; own_closures: those on the disk; closures: own_closures and
  // received ones.
  Topic<Closure> new_closures, own_closures, closures;
  Topic<PositionFix> fixes;
  Topic<InlierSet> own_inlier_sets;
  Topic<Trajectory> trajectory;
  Topic<OptimizerProgress> progress;
  Topic<ClosureVerdicts> closure_verdicts;
  Topic<InlierSet> restored_inlier_sets;

  // Inputs and outputs of OverlayNode, which connects them to the crossings below.
  Topic<PeerEvent> ways;  // peer events, and peers that can be reached through other robots only
  Topic<KeyframeBow> peer_bows;
  Topic<TeamMessage> team_messages, peer_team_messages;
  Topic<LinksReport> links;

  Crossing<KeyframeBow> bows;
  TeamChannel<KeyframeRequest> requests;
  TeamChannel<KeyframeReply> replies;
  TeamChannel<KeyframeWords> words;
  TeamChannel<Closure> shared_closures;  // between this robot and others
  TeamChannel<InlierSet> shared_inlier_sets;
  AddressedCrossing<TeamLanePacket> team_packets;
  AddressedCrossing<PlacesLanePacket> places_packets;
  // To the other robots and to the map of the team.
  Topic<MeshChunk> sent_chunks;
  Topic<MeshPoses> sent_mesh_poses;
  Crossing<MeshChunk> chunks;
  Crossing<MeshPoses> mesh_poses;
  Topic<RobotObjects> sent_objects;  // to the other robots and to the search for places
  Crossing<RobotObjects> objects;
  Crossing<RobotStatus> status;
};

template <typename T>
void forward(In<T> from, Out<T> to) {
  from.subscribe([to](const auto& message) { to.publish(message); });
}

/// For each other robot, the incarnation with which this robot has closures. Thread-safe.
class IncarnationsMet {
 public:
  /// Later closures with `peer` belong to its present incarnation.
  void meet(const TeamPeer& peer) {
    const std::lock_guard lock(mutex_);
    boots_[peer.robot] = peer.boot;
  }

  /// A boot id of the incarnation; 0 if the robot has not been met.
  [[nodiscard]] std::uint64_t of(RobotId robot) const {
    const std::lock_guard lock(mutex_);
    const auto found = boots_.find(robot);
    return found == boots_.end() ? 0 : found->second;
  }

 private:
  mutable std::mutex mutex_;  // guards boots_
  std::map<RobotId, std::uint64_t> boots_;
};

/// Progress of a robot in its input: time from the first stamp to the latest. Thread-safe.
class InputTime {
 public:
  void reach(Stamp stamp) {
    const std::lock_guard lock(mutex_);
    if (!first_) first_ = last_ = stamp;
    last_ = std::max(last_, stamp);
  }

  /// [s]; 0 before the first stamp.
  [[nodiscard]] double seconds() const {
    const std::lock_guard lock(mutex_);
    return first_ ? seconds_between(*first_, last_) : 0.0;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<Stamp> first_;
  Stamp last_ = 0;
};

/// All nodes of one robot and their connections: the system on one page (wiring.cpp).
class Robot {
 public:
  /// Builds and connects all nodes; none runs yet. Without `mapping` there is no map. `results`,
  /// which outlives this, receives the meshes. Throws ConfigError and DdsError.
  Robot(const RobotOptions& options, const RobotConfig& config, RobotInput input,
        const std::optional<MappingPlan>& mapping, ResultWriter& results, SignalWatch& signals);

  /// Runs until the robot may leave its team, a node fails, or a signal arrives. The results folder
  /// must exist.
  [[nodiscard]] RunResult run(const Supervisor::Finished& finished);

  /// True once the input has ended and the recorder has processed all messages that follow from it:
  /// no more keyframes come. Does not wait.
  bool input_ended();

  /// Takes the robot off the network, as its destructor does. For a robot that cannot be destroyed,
  /// call after run() and end the process.
  void leave();

  [[nodiscard]] const RecorderNode& recorder() const { return *recorder_; }
  [[nodiscard]] DdsBridge& bridge() { return *bridge_; }
  [[nodiscard]] const RobotStatusNode& status_node() const { return *status_; }
  [[nodiscard]] const SensorsNode* sensors() const { return sensors_; }  ///< Null without sensors.
  /// Number of images with a pose from an earlier process.
  [[nodiscard]] std::size_t restored_images() const { return restored_images_; }
  /// Null without mapping.
  [[nodiscard]] MeshFilesNode* mesh_files() { return mesh_files_; }
  /// Null unless the robots share their map.
  [[nodiscard]] const TeamMapNode* team_map() const { return team_map_; }
  /// True unless the robot has yet to send a part of its mesh, or to compare received objects with
  /// its own. Thread-safe.
  [[nodiscard]] bool has_shared_map() const {
    if (constellations_ != nullptr &&
        !(mesh_deformation_->is_current() && constellations_->is_done()))
      return false;
    return chunks_ == nullptr || (mesh_deformation_->is_current() && chunks_->is_done());
  }
  /// Null without labels.
  [[nodiscard]] ObjectsNode* objects() { return objects_; }
  /// True if another running robot had this robot's id first.
  [[nodiscard]] bool id_taken() const { return id_taken_; }
  /// Null without --localize.
  [[nodiscard]] const LocalizationNode* localization() const { return localization_; }
  /// Null without absolute fixes.
  [[nodiscard]] const FixesNode* fixes() const { return fixes_; }
  /// Time in the input at which closures tied this run to the map, or fixes determined the absolute
  /// frame; absent before.
  [[nodiscard]] std::optional<double> located_after_s() const {
    const std::lock_guard lock(progress_mutex_);
    return located_after_s_;
  }
  /// Null without --record.
  [[nodiscard]] RosOutputNode* record() { return record_; }
  [[nodiscard]] const NetworkInterface& interface() const { return participant_.interface(); }
  void set_settled(const Departure::Present& reported) {
    phase_ = reported.phase;
    settled_links_ = reported.settled_links;
  }
  /// Reports that no robot will find another closure.
  void expect_no_more_closures() { pcm_->expect_no_more(); }
  /// Stops recording; the mesh is then corrected with the present trajectory.
  void freeze_record();
  [[nodiscard]] double dataset_time_s() const { return input_time_.seconds(); }
  /// Bytes sent since the start, by category.
  [[nodiscard]] std::map<std::string, std::uint64_t> sent_bytes() const;
  /// Publishes the present state of the robot. Only one thread calls this.
  void publish_sample();
  /// For tests: messages that the nodes publish.
  [[nodiscard]] Topics& topics() { return topics_; }
  [[nodiscard]] const std::vector<const Node*>& nodes() const { return nodes_; }

 private:
  void add_sensing(const RobotConfig& config, const PlaybackPace& pace,
                   std::unique_ptr<DatasetReader> reader, const std::optional<MappingPlan>& mapping,
                   std::optional<ResumedMap> map);
  void add_odometry(VioNode::Odometry odometry, const VioTopics& topics);
  void add_place_recognition(const RobotConfig& config);
  void add_localization(const RobotConfig& config, FinishedMap map);
  void add_fixes(FixInput input);
  void publish(const JournalEntry& event);
  void add_team(RobotSample& sample) const;
  /// True if a former process left a solution of the pose graph.
  [[nodiscard]] bool has_solution() const {
    return restored_ && !restored_->solution.trajectory.T_world_kf.empty();
  }
  void add_restore();
  void add_journal(const RobotOptions& options, const RobotInput& input, ResultWriter& results);
  void add_mapping(const RobotConfig& config, const PlaybackPace& pace, const StereoRig& rig,
                   const MappingPlan& plan, std::optional<ResumedMap> before);
  void add_mesh_correction(const RobotConfig& config);
  void add_mesh_files(const std::filesystem::path& folder, ResultWriter& results);
  void add_map_2d(const Map2dConfig& config, const LabelPalette& palette);
  [[nodiscard]] CrossingEnds share_meshes(const RobotConfig& robot, const LabelPalette& palette);
  void add_objects(const ObjectsConfig& config, const LabelPalette& palette,
                   const std::filesystem::path& folder, ResultWriter& results);
  void add_playback(const RobotConfig& config, double rate, RecordedGraph graph);
  void add_loop_closure(const RobotConfig& config);
  void add_back_end(const RobotConfig& config, int dimension);
  void add_overlay();
  void add_network(CrossingEnds meshes);
  void add_records();
  void add_view(const RobotConfig& config, const std::optional<Camera>& camera);
  void add_ros_output(std::string_view node, std::unique_ptr<RosSink> sink,
                      RosOutputOptions options, std::optional<In<SensorPacket>> images);
  void add_record(const RobotOptions& options, ResultWriter& results);
  [[nodiscard]] std::string name_of(RobotId robot) const;
  [[nodiscard]] RobotStatus own_status() const;

  /// Adds a node to the supervisor; `feeds` marks nodes that are drained when the input ends.
  template <typename NodeType, typename... Arguments>
  NodeType& add(bool feeds, Arguments&&... arguments);

  const RobotIdentity identity_;
  std::shared_ptr<SharedSeal> seal_;  // null without keys
  DdsParticipant participant_;
  Topics topics_;
  const bool is_resumed_;  // continues the run of a former process
  const RestoredFrom restored_from_;
  std::optional<RestoredRun> restored_;           // empty once the robot is built
  std::shared_ptr<const Vocabulary> vocabulary_;  // null if the robot has no images
  std::atomic<bool> source_ended_ = false;
  std::atomic<bool> id_taken_ = false;
  InputTime input_time_;
  mutable std::mutex progress_mutex_;           // guards the next four members
  Topic<OptimizerProgress>::Message progress_;  // the newest
  bool is_apart_ = false;                       // not yet localised
  std::optional<double> located_after_s_;
  std::map<RobotId, double> received_s_;  // time of the last status, by the steady clock
  std::atomic<std::uint32_t> keyframes_ = 0;
  std::atomic<RobotPhase> phase_ = RobotPhase::kRunning;
  std::atomic<std::uint8_t> settled_links_ = 0;
  IncarnationsMet incarnations_;
  std::vector<Node*> feeding_;  // nodes from the source to the last one that makes keyframes
  std::vector<const Node*> nodes_;
  SensorsNode* sensors_ = nullptr;
  std::size_t restored_images_ = 0;
  RestoreNode* restore_ = nullptr;
  LocalizationNode* localization_ = nullptr;
  std::uint64_t map_id_ = 0;  // map of --localize, see TeamAgent::begin_in_map()
  FixesNode* fixes_ = nullptr;
  JournalNode* journal_ = nullptr;
  RecorderNode* recorder_ = nullptr;
  std::optional<RayThinner> ray_thinner_;  // empty without images, or once map_2d is built
  MeshDeformationNode* mesh_deformation_ = nullptr;
  MeshFilesNode* mesh_files_ = nullptr;
  MeshChunksNode* chunks_ = nullptr;
  TeamMapNode* team_map_ = nullptr;
  ObjectsNode* objects_ = nullptr;
  ConstellationsNode* constellations_ = nullptr;
  PcmNode* pcm_ = nullptr;
  RobotStatusNode* status_ = nullptr;
  RosOutputNode* record_ = nullptr;
  RosOutputNode* ros_output_ = nullptr;
  OverlayNode* overlay_ = nullptr;
  ViewNode* view_ = nullptr;
  std::optional<ModuleLoads> loads_;
  DdsBridge* bridge_ = nullptr;
  Supervisor
      supervisor_;  // last member: stops the nodes before the objects that they use are destroyed
};

template <typename NodeType, typename... Arguments>
NodeType& Robot::add(bool feeds, Arguments&&... arguments) {
  NodeType& node = supervisor_.emplace<NodeType>(std::forward<Arguments>(arguments)...);
  if (feeds) feeding_.push_back(&node);
  nodes_.push_back(&node);
  return node;
}

}  // namespace km
