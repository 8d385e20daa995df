#include "apps/robot/assemblies/records.hpp"

#include <type_traits>
#include <utility>
#include <vector>

#include "apps/robot/results.hpp"
#include "modules/ros_dds/node/live_topics.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "runtime/log.hpp"
#include "runtime/metrics.hpp"

namespace km {
namespace {

constexpr int kMeshPoints = 200000, kMeshFaces = 50000;  // largest mesh for viewers
constexpr double kMeshBytesPerS = 2e6;                   // average rate of its faces

}  // namespace

Records::Records(RobotCore& core, const Sources& sources)
    : core_(core), sources_(sources), progress_(core, sources.places) {
  recorder_ = &core_.nodes.add<RecorderNode>(core_.identity.robot,
                                             [this](const JournalEntry& event) { publish(event); });
  if (core_.past.has_solution())
    recorder_->add(std::make_shared<const TeamSolution>(core_.past.run->solution));
  Topics& t = core_.topics;
  recorder_->record(t.restored_inlier_sets, t.restored_odometry, t.odometry, t.keyframe_odometry,
                    t.odometry_statistics, t.keyframes, t.replies.received, t.closure_restarts,
                    t.closures, t.outcomes, t.restored_outcomes, t.place_queries, t.own_inlier_sets,
                    t.shared_inlier_sets.received, t.trajectory, t.progress, t.closure_verdicts,
                    t.dense_sensing_progress, t.mapping_progress, t.maps, t.optimized_meshes);
  status_ = &core_.nodes.add<RobotStatusNode>(
      [this] { return progress_.status(sources_.back_end.overlay()); },
      RobotStatusTopics{.own = t.status.to_peers(), .peers = t.status.from_peers()});
}

void Records::add_view(const ViewConfig& config, const std::optional<Camera>& camera) {
  if (!config.on) return;
  if (core_.seal != nullptr) {
    log::info(ViewConfig::kSection) << "off: the team has keys, and viewers would receive data "
                                       "without encryption";
    return;
  }
  Topics& t = core_.topics;
  view_ = &core_.nodes.add<ViewNode>(config, core_.participant, camera,
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

void Records::add_ros(std::shared_ptr<const RosNetwork> network) {
  add_output(
      "ros_output", std::make_unique<LiveSink>(std::move(network)),
      {.mesh_points = kMeshPoints, .mesh_faces = kMeshFaces, .mesh_bytes_per_s = kMeshBytesPerS},
      std::nullopt);
}

// Files of several robots can be merged: each has a map frame of its own, and the file states when
// it coincides with the team's. The record has its own node, so that viewers do not wait for the
// disk.
void Records::add_record(const RobotOptions& options, ResultWriter& results) {
  constexpr double kState_bytes_per_s = 200e3;  // rate of uncompressed meshes, paths and closures
  constexpr std::size_t kQueue = 10000;         // messages of a minute in which the disk stalls
  const std::filesystem::path& file = *options.record;
  record_ = &add_output(
      "record",
      std::make_unique<McapSink>(
          file, [file, &results](const std::string& why) { results.note(file, why); }),
      {.name_of = [this](RobotId robot) { return name_of(robot); },
       .mesh_points = kMeshPoints,
       .draws = true,
       .logs = true,
       .state_bytes_per_s = kState_bytes_per_s,
       .queue = kQueue},
      options.record_images ? std::optional<In<SensorPacket>>(core_.topics.packets) : std::nullopt);
}

RosOutputNode& Records::add_output(std::string_view node, std::unique_ptr<RosSink> sink,
                                   RosOutputOptions options,
                                   std::optional<In<SensorPacket>> images) {
  options.robot = core_.identity.name;
  options.id = core_.identity.robot;
  options.awaits_trajectory = sources_.places.locator() != nullptr;
  if (const ObjectsNode* objects = sources_.mapping.objects()) options.objects = objects->palette();
  Topics& t = core_.topics;
  auto& output = core_.nodes.add<RosOutputNode>(
      node, std::move(sink), std::move(options),
      [this, loads = ModuleLoads(core_.nodes.all())]() mutable {
        std::vector<RosDiagnosticStatus> all = {loads.status()};
        if (const SensorsNode* sensors = sources_.sensing.sensors())
          all.push_back(
              sensors_status(sensors->published(), sensors->skipped(), sensors->faults()));
        if (const auto optimizer = progress_.optimizer()) all.push_back(team_status(*optimizer));
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
      RosOutputTopics{.odometry = t.odometry,
                      .keyframes = t.keyframe_odometry,
                      .trajectory = t.trajectory,
                      .images = images});
  t.optimized_meshes.subscribe([&output](const auto& optimized) {
    output.offer({optimized, &optimized->mesh});
  });
  t.joint_objects.subscribe([&output](const auto& objects) { output.offer(objects); });
  t.maps_2d.subscribe([&output](const auto& map) { output.offer(map); });
  return output;
}

std::string Records::name_of(RobotId robot) const {
  if (robot == core_.identity.robot) return core_.identity.name;
  for (const Peer& peer : core_.bridge->peers().list())
    if (peer.identity.robot == robot) return peer.identity.name;
  return "robot" + std::to_string(robot);
}

// Passes an event of the recorder to the journal and to viewers.
void Records::publish(const JournalEntry& event) {
  sources_.journal.append(event);
  const auto offer = [this]<typename Event>(const Event& one) {
    if constexpr (std::is_same_v<Event, ClosureJudgements> || std::is_same_v<Event, PoseChanges> ||
                  std::is_same_v<Event, RobotSample>)
      view_->offer(one);
  };
  if (view_ != nullptr) std::visit(offer, event);
}

std::map<std::string, std::uint64_t> Records::sent_bytes() const {
  using enum TrafficCategory;
  const TrafficSnapshot traffic = core_.bridge->traffic();
  std::map<std::string, std::uint64_t> bytes;
  for (const auto category :
       {kPlaceRecognition, kGeometricVerification, kPoseGraphOptimization, kMap, kOther})
    bytes[to_string(category)] = traffic.bytes(Direction::kOut, category);
  return bytes;
}

void Records::publish_sample() {
  const ProcessUsage usage = process_usage();
  RobotSample state;
  progress_.add_to(state);
  if (const SensorsNode* sensors = sources_.sensing.sensors())
    state.skipped_frames = static_cast<std::uint32_t>(sensors->skipped());
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
  recorder_->add(std::make_shared<const RobotSample>(std::move(state)));
}

}  // namespace km
