#include "apps/robot/wiring.hpp"

#include <cmath>
#include <utility>

#include "apps/program_version.hpp"
#include "apps/result_files.hpp"
#include "apps/robot/growing_files.hpp"
#include "apps/robot/results.hpp"
#include "apps/robot/team_keys_node.hpp"
#include "modules/core/text_table.hpp"
#include "modules/loop_closure/node/keyframe_features_node.hpp"
#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/loop_closure/node/loop_closure_node.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/objects/node/objects_codec.hpp"
#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"
#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "modules/place_recognition/node/place_recognition_node.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "modules/ros_dds/node/live_topics.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "modules/session/node/team_codec.hpp"
#include "modules/session/node/team_node.hpp"

namespace km {
namespace {

constexpr std::string_view kRecordNode = "record";
constexpr int kMeshPoints = 200000, kMeshFaces = 50000;  // largest mesh for viewers
constexpr double kMeshBytesPerS = 2e6;                   // average rate of its faces

// True if keyframe 0 is the origin of the frame of a map or of fixes, and not of this run.
bool begins_at_origin(RestoredFrom from) {
  return from == RestoredFrom::kFinishedMap || from == RestoredFrom::kDatum;
}

// True if this process continues the run of a former one.
bool is_resumed(const RobotInput& input) {
  return input.restored && !begins_at_origin(input.restored_from) &&
         !std::holds_alternative<PastRun>(input.source);
}

// A resumed run continues its incarnation.
std::uint64_t boot_of(const RobotInput& input) {
  return is_resumed(input) ? next_boot(input.restored->boot) : random_boot_id();
}

std::optional<Camera> left_camera_of(const RobotInput& input) {
  const auto* reader = std::get_if<std::unique_ptr<DatasetReader>>(&input.source);
  return reader != nullptr ? std::optional((*reader)->rig().stereo.cameras[0]) : std::nullopt;
}

std::optional<KeyframeId> keyframe_of(const KeyframeReply& reply) {
  return reply.found ? std::optional(reply.keyframe.odometry.id) : std::nullopt;
}

}  // namespace

Robot::Robot(const RobotOptions& options, const RobotConfig& config, RobotInput input,
             const std::optional<MappingPlan>& mapping, ResultWriter& results, SignalWatch& signals)
    : identity_{.robot = options.robot, .name = options.name, .boot = boot_of(input)},
      seal_(make_team_seal(options.security, identity_)),
      participant_(config.dds, identity_, seal_),
      is_resumed_(is_resumed(input)),
      restored_from_(input.restored_from),
      restored_(std::move(input.restored)),
      supervisor_(signals, config.run.patience) {
  auto bridge = std::make_unique<DdsBridge>(participant_, config.budget);
  bridge_ = bridge.get();
  const std::optional<Camera> camera = left_camera_of(input);
  const auto* recorded = std::get_if<RecordedGraph>(&input.source);
  const int dimension = recorded == nullptr ? 3 : recorded->dimension;
  if (auto* reader = std::get_if<std::unique_ptr<DatasetReader>>(&input.source))
    add_sensing(config, options.pace, std::move(*reader), mapping, std::move(input.map));
  else if (auto* graph = std::get_if<RecordedGraph>(&input.source))
    add_playback(config, options.pace.rate, std::move(*graph));
  else
    add_restore();
  source_ended_ = std::holds_alternative<PastRun>(input.source);
  if (!std::holds_alternative<RecordedGraph>(input.source)) add_place_recognition(config);
  if (input.localize_in) {
    map_id_ = input.localize_in->id();
    add_localization(config, *std::move(input.localize_in));
  }
  if (input.fixes) add_fixes(*std::move(input.fixes));
  add_loop_closure(config);
  add_journal(options, input, results);
  add_back_end(config, dimension);
  add_overlay();
  if (mapping) {
    add_mesh_correction(config);
    if (config.map_2d.enabled && ray_thinner_) add_map_2d(config.map_2d, mapping->palette);
    add_mesh_files(options.output, results);
  }
  if (mapping && !mapping->palette.classes().empty() && config.objects.on)
    add_objects(config.objects, mapping->palette, options.output, results);
  add_network(share_meshes(config, mapping ? mapping->palette : LabelPalette()));
  add_records();
  add_view(config, camera);
  if (input.ros != nullptr && config.ros.publish.value_or(true))
    add_ros_output(
        "ros_output", std::make_unique<LiveSink>(std::move(input.ros)),
        {.mesh_points = kMeshPoints, .mesh_faces = kMeshFaces, .mesh_bytes_per_s = kMeshBytesPerS},
        std::nullopt);
  if (options.record) add_record(options, results);
  if (seal_ != nullptr)
    add<TeamKeysNode>(false, options.security, *seal_,
                      [this](const MembershipChange& change) { bridge_->apply(change); });
  nodes_.push_back(bridge_);
  supervisor_.add(std::move(bridge));
  loads_.emplace(nodes_);
  if (restore_ != nullptr) restore_->set(*std::exchange(restored_, std::nullopt));
}

RunResult Robot::run(const Supervisor::Finished& finished) {
  journal_->write();
  RunResult result = supervisor_.run(finished);
  if (!result.is_left_behind(journal_->name())) journal_->write();
  return result;
}

// Call after the source is added: the supervisor starts nodes in reverse order, so this one starts
// first.
void Robot::add_restore() {
  if (!restored_) return;
  restored_images_ = restored_->final_states();
  for (const auto& [robot, peer] : restored_->peers) {
    bridge_->peers().tell(&PeerTable::recall,
                          {.robot = robot, .name = peer.name, .boot = peer.boot});
    incarnations_.meet({robot, peer.boot});
  }
  restore_ = &add<RestoreNode>(
      false, RestoreTopics{.states = topics_.restored_odometry,
                           .odometry = topics_.keyframe_odometry,
                           .keyframes = begins_at_origin(restored_from_) ? topics_.new_keyframes
                                                                         : topics_.keyframes,
                           .own_closures = topics_.own_closures,
                           .peer_closures = topics_.closures,
                           .outcomes = topics_.restored_outcomes,
                           .inlier_sets = topics_.restored_inlier_sets});
}

// Call after the nodes that find closures and before those that read them, so that none is lost at
// the end.
void Robot::add_journal(const RobotOptions& options, const RobotInput& input,
                        ResultWriter& results) {
  journal_ = &add<JournalNode>(false, options.output / kJournal, results,
                               JournalStart{identity_.robot, identity_.boot, input.name},
                               is_resumed_ ? &*restored_ : nullptr, input.rig_correction,
                               JournalTopics{.states = topics_.odometry,
                                             .odometry = topics_.keyframe_odometry,
                                             .new_keyframes = topics_.new_keyframes,
                                             .new_closures = topics_.new_closures,
                                             .new_restarts = topics_.new_closure_restarts,
                                             .peer_closures = topics_.shared_closures.received,
                                             .outcomes = topics_.outcomes,
                                             .restored_outcomes = topics_.restored_outcomes,
                                             .peer_events = bridge_->peers().events(),
                                             .keyframes = topics_.keyframes,
                                             .closures = topics_.own_closures,
                                             .restarts = topics_.closure_restarts});
}

void Robot::add_odometry(VioNode::Odometry odometry, const VioTopics& topics) {
  auto& node = add<VioNode>(true, std::move(odometry), topics);
  if (!restored_) return;
  VioCheckpoint checkpoint{.state = {}, .keyframe = restored_->odometry.back()};
  const std::size_t states = restored_->final_states();
  if (restored_from_ == RestoredFrom::kFormerProcess && states > 0)
    checkpoint.state = restored_->states[states - 1];
  node.continue_from(checkpoint);
}

void Robot::add_sensing(const RobotConfig& config, const PlaybackPace& pace,
                        std::unique_ptr<DatasetReader> reader,
                        const std::optional<MappingPlan>& mapping, std::optional<ResumedMap> map) {
  const SensorRig rig = reader->rig();
  const bool gives_poses = reader->gives_poses();
  sensors_ = &add<SensorsNode>(true, config.sensors, pace, std::move(reader),
                               SensorsTopics{.processed = topics_.processed_frames,
                                             .packets = topics_.packets,
                                             .load = topics_.shed_load,
                                             .end = [this](const auto&) { source_ended_ = true; }});
  add_restore();
  const VioTopics odometry{.packets = topics_.packets,
                           .odometry = topics_.odometry,
                           .keyframes = topics_.keyframe_odometry,
                           .frames = topics_.located_frames,
                           .statistics = topics_.odometry_statistics,
                           .images = topics_.tracked_images,
                           .processed = topics_.processed_frames};
  if (gives_poses)
    add_odometry(ExternalOdometry(identity_.robot, rig.stereo.depth_source, config.vio), odometry);
  else
    add_odometry(Vio(identity_.robot, rig, config.tracker, config.vio), odometry);
  if (mapping) add_mapping(config, pace, rig.stereo, *mapping, std::move(map));
  std::optional<KeypointDescriber> keypoint_describer;
  if (const std::string& network = config.keyframe_features.network; !network.empty())
    keypoint_describer.emplace(find_shipped_file(network, "keyframe_features.network"));
  auto& features =
      add<KeyframeFeaturesNode>(true, config.keyframe_features, rig.stereo,
                                KeyframeFeaturesTopics{.odometry = topics_.keyframe_odometry,
                                                       .frames = topics_.located_frames,
                                                       .keyframes = topics_.new_keyframes},
                                std::move(keypoint_describer));
  if (restored_) features.continue_from(restored_->keyframes.back().odometry);
}

void Robot::add_place_recognition(const RobotConfig& config) {
  vocabulary_ = std::make_shared<const Vocabulary>(
      load_vocabulary(find_shipped_file(config.run.vocabulary, "run.vocabulary")));
  add<PlaceRecognitionNode>(false, config.place_recognition, identity_.robot, vocabulary_,
                            PlaceRecognitionTopics{.keyframes = topics_.keyframes,
                                                   .peer_bows = topics_.peer_bows,
                                                   .closures = topics_.own_closures,
                                                   .peer_events = bridge_->peers().events(),
                                                   .own_bows = topics_.bows.to_peers(),
                                                   .candidates = topics_.candidates,
                                                   .restarts = topics_.candidate_restarts,
                                                   .queries = topics_.place_queries});
}

void Robot::add_localization(const RobotConfig& config, FinishedMap map) {
  localization_ = &add<LocalizationNode>(
      false, MapMatcher(config.place_recognition, config.loop_closure, vocabulary_, std::move(map)),
      LocalizationTopics{.keyframes = topics_.keyframes,
                         .closures = topics_.new_closures,
                         .outcomes = topics_.outcomes});
}

// Keyframe 0 of a resumed run is the origin, too.
void Robot::add_fixes(FixInput input) {
  fixes_ =
      &add<FixesNode>(true, std::move(input),
                      FixesTopics{.states = topics_.odometry,
                                  .restored_states = topics_.restored_odometry,
                                  .keyframes = topics_.keyframe_odometry,
                                  .fixes = topics_.fixes,
                                  .received = [this](const auto& fix) { journal_->append(fix); }});
}

void Robot::add_playback(const RobotConfig& config, double rate, RecordedGraph graph) {
  auto& playback = add<GraphPlaybackNode>(
      true, config.graph_playback, rate, std::move(graph),
      GraphPlaybackTopics{.odometry = topics_.keyframe_odometry,
                          .keyframes = topics_.new_keyframes,
                          .closures = topics_.measured_closures,
                          .end = [this](const auto&) { source_ended_ = true; }});
  if (restored_) playback.continue_after(restored_->keyframes.size());
  add_restore();
  bridge_->peers().events().subscribe(
      [to = Out<PeerEvent>(topics_.candidate_restarts)](const auto& event) {
        if (event->kind == PeerEventKind::kRestarted) to.publish(event);
      });
}

void Robot::add_loop_closure(const RobotConfig& config) {
  add<LoopClosureNode>(false, config.loop_closure, identity_.robot, vocabulary_,
                       LoopClosureTopics{.keyframes = topics_.keyframes,
                                         .candidates = topics_.candidates,
                                         .measured_closures = topics_.measured_closures,
                                         .peer_requests = topics_.requests.received,
                                         .peer_replies = topics_.replies.received,
                                         .peer_words = topics_.words.received,
                                         .peer_closures = topics_.shared_closures.received,
                                         .peer_events = topics_.ways,
                                         .restarts = topics_.candidate_restarts,
                                         .peer_bows = topics_.peer_bows,
                                         .restored = topics_.restored_outcomes,
                                         .own_requests = topics_.requests.own,
                                         .own_replies = topics_.replies.own,
                                         .own_words = topics_.words.own,
                                         .own_closures = topics_.new_closures,
                                         .own_restarts = topics_.new_closure_restarts,
                                         .outcomes = topics_.outcomes},
                       [this](KeyframeIndex keyframe) -> std::shared_ptr<const Keyframe> {
                         return journal_->recall(keyframe);
                       });
}

void Robot::add_back_end(const RobotConfig& config, int dimension) {
  forward<Closure>(topics_.own_closures, topics_.closures);
  forward<Closure>(topics_.shared_closures.received, topics_.closures);
  pcm_ = &add<PcmNode>(false, config.pcm, identity_.robot,
                       PcmTopics{.closures = topics_.closures,
                                 .keyframes = topics_.keyframe_odometry,
                                 .restarts = topics_.closure_restarts,
                                 .restored = topics_.restored_inlier_sets,
                                 .inlier_sets = topics_.own_inlier_sets},
                       resume_count(identity_.boot) << kResumeBits);
  auto& team = add<TeamNode>(
      false, config.pose_graph, TeamPeer{identity_.robot, identity_.boot},
      solver_choice(config.pose_graph, dimension), [this] { return overlay_->session_bytes(); },
      TeamTopics{.odometry = topics_.keyframe_odometry,
                 .closures = topics_.closures,
                 .fixes = topics_.fixes,
                 .inlier_sets = topics_.own_inlier_sets,
                 .peer_inlier_sets = topics_.shared_inlier_sets.received,
                 .restored_inlier_sets = topics_.restored_inlier_sets,
                 .peer_events = bridge_->peers().events(),
                 .restarts = topics_.closure_restarts,
                 .links = topics_.links,
                 .peer_messages = topics_.peer_team_messages,
                 .messages = topics_.team_messages,
                 .trajectory = topics_.trajectory,
                 .progress = topics_.progress,
                 .verdicts = topics_.closure_verdicts},
      dimension);
  team.begin_in_map(map_id_);
  if (has_solution()) team.restore(restored_->solution);
}

void Robot::add_overlay() {
  Topics& t = topics_;
  const In<PeerEvent> peer_events = bridge_->peers().events();
  forward<PeerEvent>(peer_events, t.ways);
  overlay_ = &add<OverlayNode>(
      false, TeamPeer{identity_.robot, identity_.boot}, seal_.get(), bridge_->peers(),
      OverlayTopics{.peer_events = peer_events,
                    .statuses = t.status.from_peers(),
                    .team_packets = t.team_packets.to_peers(),
                    .places_packets = t.places_packets.to_peers(),
                    .reached = t.ways,
                    .links = t.links,
                    .renew = [this](RobotId robot) { bridge_->renew(robot); }});
  join_team(*overlay_, t.team_messages, t.peer_team_messages);
  overlay_->join<KeyframeBow>(OverlayStream::kBag, t.bows.from_peers(), t.peer_bows);
  overlay_->join_calls(
      OverlayStream::kRequest, t.requests.ends(),
      [](const KeyframeRequest& request) { return std::optional(request.keyframe); });
  overlay_->join_calls(OverlayStream::kReply, t.replies.ends(), keyframe_of);
  overlay_->join_calls(OverlayStream::kWords, t.words.ends(),
                       [](const KeyframeWords& words) { return std::optional(words.keyframe); });
  overlay_->join_reliable(OverlayStream::kClosure, t.shared_closures.ends());
  overlay_->join_reliable(OverlayStream::kInlierSet, t.shared_inlier_sets.ends());
}

void Robot::add_network(CrossingEnds meshes) {
  using enum TopicKind;
  using enum TrafficCategory;
  DdsBridge& dds = *bridge_;
  Topics& t = topics_;
  // All crossings between robots, with their kind and the category under which their bytes are
  // counted.
  dds.exchange(t.bows, kEvent, kPlaceRecognition, {}, {},
               overlay_->guard<KeyframeBow>(OverlayStream::kBag, [](const KeyframeBow& bow) {
                 return std::optional(bow.id);
               }));
  // The reply to a request of 60 bytes has up to 4 kB.
  dds.exchange(t.requests.direct, kRequest, kGeometricVerification, {},
               {.per_second = 30, .burst = 60});
  dds.exchange(t.replies.direct, kRequest, kGeometricVerification, {}, {},
               overlay_->guard<KeyframeReply>(OverlayStream::kReply, keyframe_of));
  dds.exchange(t.words.direct, kRequest, kGeometricVerification);
  dds.exchange(t.shared_closures.direct, kEvent, kGeometricVerification);
  dds.exchange(t.shared_inlier_sets.direct, kState, kPoseGraphOptimization);
  dds.exchange(t.team_packets, kRequest, kPoseGraphOptimization, {}, {},
               overlay_->guard_packets<OverlayLane::kTeam>());
  dds.exchange(t.places_packets, kRequest, kOther, {}, {},
               overlay_->guard_packets<OverlayLane::kPlaces>());
  dds.exchange(t.chunks, kState, kMap, meshes);
  dds.exchange(t.mesh_poses, kState, kMap, meshes);
  const bool has_objects = objects_ != nullptr;
  dds.exchange(t.objects, kState, kMap, {.send = has_objects, .receive = has_objects});
  dds.exchange(t.status, kStatus, kOther);
  // Closures and inlier sets are sent only to the robots that they connect.
  t.own_closures.subscribe(
      [this, to = Out<Addressed<Closure>>(t.shared_closures.own)](const auto& closure) {
        const RobotId other = closure->to.id.robot;
        if (other != closure->from.id.robot)
          to.publish(Addressed<Closure>{other, closure, incarnations_.of(other)});
      });
  const auto meet = [this](const auto& event) {
    incarnations_.meet({event->identity.robot, event->identity.boot});
  };
  t.closure_restarts.subscribe(meet);
  t.own_inlier_sets.subscribe(
      [this, to = Out<Addressed<InlierSet>>(t.shared_inlier_sets.own)](const auto& set) {
        if (set->a != set->b)
          to.publish(Addressed<InlierSet>{set->b, set, incarnations_.of(set->b)});
      });
  dds.peers().events().subscribe([this, meet](const auto& event) {
    if (event->kind == PeerEventKind::kJoined || event->kind == PeerEventKind::kReported)
      meet(event);
    if (event->kind == PeerEventKind::kConflict && event->identity.robot == identity_.robot)
      id_taken_ = true;
  });
}

void Robot::add_records() {
  recorder_ = &add<RecorderNode>(false, identity_.robot,
                                 [this](const JournalEntry& event) { publish(event); });
  if (has_solution()) recorder_->add(std::make_shared<const TeamSolution>(restored_->solution));
  Topics& t = topics_;
  recorder_->record(t.restored_inlier_sets, t.restored_odometry, t.odometry, t.keyframe_odometry,
                    t.odometry_statistics, t.keyframes, t.replies.received, t.closure_restarts,
                    t.closures, t.outcomes, t.restored_outcomes, t.place_queries, t.own_inlier_sets,
                    t.shared_inlier_sets.received, t.trajectory, t.progress, t.closure_verdicts,
                    t.dense_sensing_progress, t.mapping_progress, t.maps, t.optimized_meshes);
  topics_.packets.subscribe(
      [this](const auto& packet) { input_time_.reach(packet->frame->stamp); });
  topics_.progress.subscribe([this](const auto& progress) {
    const std::lock_guard lock(progress_mutex_);
    progress_ = progress;
    const bool was_apart = std::exchange(is_apart_, !progress->located);
    if (is_apart_ || !was_apart || located_after_s_) return;
    if (localization_ == nullptr && fixes_ == nullptr) return;
    located_after_s_ = input_time_.seconds();
    log::info(fixes_ != nullptr ? fixes_->name() : localization_->name())
        << (fixes_ != nullptr ? "located after " : "localised after ")
        << fixed(*located_after_s_, 1) << " s";
  });
  topics_.status.from_peers().subscribe([this](const auto& status) {
    const std::lock_guard lock(progress_mutex_);
    received_s_[status->robot] = steady_now_s();
  });
  topics_.keyframe_odometry.subscribe([this](const auto& keyframe) {
    // Keyframe 0 of a map or of fixes has no time of this run, also after --resume.
    const bool is_of_map = (localization_ != nullptr || fixes_ != nullptr) &&
                           keyframe->id.index == 0 && keyframe->stamp == 0;
    // A pose graph and a former process have no packets.
    if (!is_of_map) input_time_.reach(keyframe->stamp);
    ++keyframes_;
  });
  status_ = &add<RobotStatusNode>(
      false, [this] { return own_status(); },
      RobotStatusTopics{.own = topics_.status.to_peers(), .peers = topics_.status.from_peers()});
}

void Robot::add_ros_output(std::string_view node, std::unique_ptr<RosSink> sink,
                           RosOutputOptions options, std::optional<In<SensorPacket>> images) {
  options.robot = identity_.name;
  options.id = identity_.robot;
  options.awaits_trajectory = localization_ != nullptr || fixes_ != nullptr;
  if (objects_ != nullptr) options.objects = objects_->palette();
  auto& output = add<RosOutputNode>(
      false, node, std::move(sink), std::move(options),
      [this, loads = ModuleLoads(nodes_)]() mutable {
        std::vector<RosDiagnosticStatus> all = {loads.status()};
        if (sensors_ != nullptr)
          all.push_back(
              sensors_status(sensors_->published(), sensors_->skipped(), sensors_->faults()));
        if (const std::lock_guard lock(progress_mutex_); progress_ != nullptr)
          all.push_back(team_status(*progress_));
        return all;
      },
      [this, activity = std::optional<std::uint64_t>()]() mutable {
        std::optional<std::vector<PublishedClosure>> closures;
        (void)recorder_->try_with_record([&](const RunRecord& record) {
          if (std::exchange(activity, record.activity()) != record.activity())
            closures = published_closures(record);
        });
        return closures;
      },
      RosOutputTopics{.odometry = topics_.odometry,
                      .keyframes = topics_.keyframe_odometry,
                      .trajectory = topics_.trajectory,
                      .images = images});
  topics_.optimized_meshes.subscribe([&output](const auto& optimized) {
    output.offer({optimized, &optimized->mesh});
  });
  topics_.joint_objects.subscribe([&output](const auto& objects) { output.offer(objects); });
  topics_.maps_2d.subscribe([&output](const auto& map) { output.offer(map); });
  (node == kRecordNode ? record_ : ros_output_) = &output;
}

// Files of several robots can be merged: each has a map frame of its own, and the file states when
// it coincides with the team's. The record has its own node, so that viewers do not wait for the
// disk.
void Robot::add_record(const RobotOptions& options, ResultWriter& results) {
  constexpr double kState_bytes_per_s = 200e3;  // rate of uncompressed meshes, paths and closures
  constexpr std::size_t kQueue = 10000;         // messages of a minute in which the disk stalls
  const std::filesystem::path& file = *options.record;
  add_ros_output(
      kRecordNode,
      std::make_unique<McapSink>(
          file, [file, &results](const std::string& why) { results.note(file, why); }),
      {.name_of = [this](RobotId robot) { return name_of(robot); },
       .mesh_points = kMeshPoints,
       .draws = true,
       .logs = true,
       .state_bytes_per_s = kState_bytes_per_s,
       .queue = kQueue},
      options.record_images ? std::optional<In<SensorPacket>>(topics_.packets) : std::nullopt);
}

std::string Robot::name_of(RobotId robot) const {
  if (robot == identity_.robot) return identity_.name;
  for (const Peer& peer : bridge_->peers().list())
    if (peer.identity.robot == robot) return peer.identity.name;
  return "robot" + std::to_string(robot);
}

void Robot::add_view(const RobotConfig& config, const std::optional<Camera>& camera) {
  if (!config.view.on) return;
  if (seal_ != nullptr) {
    log::info(ViewConfig::kSection) << "off: the team has keys, and viewers would receive data "
                                       "without encryption";
    return;
  }
  Topics& t = topics_;
  view_ = &add<ViewNode>(false, config.view, participant_, camera,
                         ViewTopics{.odometry = t.odometry,
                                    .keyframes = t.keyframe_odometry,
                                    .outcomes = t.outcomes,
                                    .restored_outcomes = t.restored_outcomes,
                                    .closures = t.closures,
                                    .restarts = t.closure_restarts,
                                    .objects = t.joint_objects,
                                    .maps_2d = t.maps_2d,
                                    .images = t.tracked_images});
  t.optimized_meshes.subscribe([this](const auto& optimized) {
    view_->offer(optimized->anchor, {optimized, &optimized->mesh});
  });
}

// Passes an event of the recorder to the journal and to viewers.
void Robot::publish(const JournalEntry& event) {
  journal_->append(event);
  const auto offer = [this]<typename Event>(const Event& one) {
    if constexpr (std::is_same_v<Event, ClosureJudgements> || std::is_same_v<Event, PoseChanges> ||
                  std::is_same_v<Event, RobotSample>)
      view_->offer(one);
  };
  if (view_ != nullptr) std::visit(offer, event);
}

std::map<std::string, std::uint64_t> Robot::sent_bytes() const {
  using enum TrafficCategory;
  const TrafficSnapshot traffic = bridge_->traffic();
  std::map<std::string, std::uint64_t> bytes;
  for (const auto category :
       {kPlaceRecognition, kGeometricVerification, kPoseGraphOptimization, kMap, kOther})
    bytes[to_string(category)] = traffic.bytes(Direction::kOut, category);
  return bytes;
}

void Robot::publish_sample() {
  const ProcessUsage usage = process_usage();
  RobotSample state;
  state.name = identity_.name;
  state.phase = to_string(phase_.load());
  state.dataset_time_s = input_time_.seconds();
  state.keyframes = keyframes_;
  state.skipped_frames = sensors_ != nullptr ? static_cast<std::uint32_t>(sensors_->skipped()) : 0;
  state.cpu_s = usage.cpu_s;
  state.resident_MB = static_cast<double>(usage.resident_bytes) / 1e6;
  for (const auto& [category, bytes] : sent_bytes())
    state.sent_bytes.push_back({category, static_cast<double>(bytes)});
  constexpr double kIdle = 0.005;  // share below which a module gets no line
  for (const auto& [name, share] : loads_->shares())
    if (share > kIdle) state.loads.push_back({name, share});
  for (const auto& [name, channel] : {std::pair{"view", ViewChannel::kView},
                                      {"view_mesh", ViewChannel::kMesh},
                                      {"view_images", ViewChannel::kImages}})
    if (view_ != nullptr)
      state.sent_bytes.push_back({name, static_cast<double>(view_->sent_bytes(channel))});
  add_team(state);
  recorder_->add(std::make_shared<const RobotSample>(std::move(state)));
}

void Robot::add_team(RobotSample& sample) const {
  const auto finite = [](double value) { return std::isfinite(value) ? value : 0.0; };
  const double now_s = steady_now_s();
  sample.anchor = identity_.robot;
  const std::lock_guard lock(progress_mutex_);
  for (const auto& [robot, received_s] : received_s_)
    sample.links.push_back({robot, static_cast<float>(std::max(0.0, now_s - received_s))});
  if (progress_ == nullptr) return;
  sample.anchor = progress_->anchor;
  sample.tentative = std::ranges::binary_search(progress_->tentative, progress_->anchor);
  sample.round = progress_->round;
  sample.cost = finite(progress_->cost);
  sample.gradient_norm = finite(progress_->gradient_norm);
}

RobotStatus Robot::own_status() const {
  return {identity_.robot, identity_.name, phase_,         input_time_.seconds(),
          keyframes_,      settled_links_, identity_.boot, overlay_->summary()};
}

void Robot::freeze_record() {
  recorder_->freeze();
  if (mesh_deformation_ != nullptr) mesh_deformation_->finish();
}

bool Robot::input_ended() {
  return source_ended_ && supervisor_.have_stopped(feeding_) && !journal_->holds_back();
}

void Robot::leave() {
  supervisor_.remove(*std::exchange(bridge_, nullptr));
}

}  // namespace km
