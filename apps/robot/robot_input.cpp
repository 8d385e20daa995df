#include "apps/robot/robot_input.hpp"

#include <algorithm>
#include <atomic>
#include <limits>
#include <stdexcept>
#include <thread>
#include <utility>

#include "apps/result_files.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/map_file.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/node/live_topics.hpp"
#include "modules/sensors/folder_layouts.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "modules/sensors/sample_streams.hpp"
#include "modules/sensors/text_file.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

DepthFrom depth_source(DenseSource wanted, const ImageSources& sources) {
  if (wanted == DenseSource::kRecorded && !sources.depth)
    throw ConfigError("mapping.depth: recorded, but there are no depth images in " + sources.place +
                      "; stereo computes it");
  if (wanted == DenseSource::kComputed && !sources.right)
    throw ConfigError("mapping.depth: stereo, but there is no right camera in " + sources.place);
  return sources.depth && wanted != DenseSource::kComputed ? DepthFrom::kImages
                                                           : DepthFrom::kStereo;
}

LabelsFrom label_source(DenseSource wanted, bool has_network, const ImageSources& sources) {
  if (wanted == DenseSource::kRecorded && !sources.labels)
    throw ConfigError("mapping.labels: recorded, but there are no label images in " +
                      sources.place);
  if (wanted == DenseSource::kComputed && !has_network)
    throw ConfigError("mapping.labels: network, but segmentation.network names no file");
  if (!sources.labels && !has_network)
    throw ConfigError("mapping.mode: semantic needs labels, but there are no label images in " +
                      sources.place +
                      " and segmentation.network names no file; metric does without");
  return sources.labels && wanted != DenseSource::kComputed ? LabelsFrom::kImages
                                                            : LabelsFrom::kNetwork;
}

LabelPalette read_palette(const fs::path& file) {
  if (!is_file(file))
    throw ConfigError(file.string() +
                      ": no such file; mapping.mode: semantic needs a table of the labels there, "
                      "or as segmentation.palette");
  try {
    return parse_label_palette(read_file(file), file.string());
  } catch (const std::invalid_argument& error) {
    throw ConfigError(error.what());
  }
}

// True if this process begins to extend a run; false if it continues to do so.
bool extends(const RobotOptions& options) {
  return !options.extend.empty() && !options.resume;
}

// True for messages of ROS, recorded or live; false for a folder of images.
bool has_messages(const RobotOptions& options) {
  return options.is_live || (!options.dataset.empty() && may_be_bag(options.dataset));
}

// States the damaged parts and the incomplete end of the journal. Keeps a copy of a damaged journal
// from the first time. The damaged bytes stay in a resumed journal, so a later resume finds them
// again.
void report_damage(const fs::path& file, const RestoredRun& run) {
  if (run.journal.cut_bytes > 0)
    log::warn("journal") << file.string() << ": the last " << run.journal.cut_bytes
                         << " bytes are incomplete: cut after entry " << run.journal.entries
                         << ", byte " << run.journal.whole_bytes;
  for (const JournalDamage& damage : run.journal.damages)
    log::warn("journal") << to_string(damage, file);
  if (run.journal.damages.empty()) return;
  const fs::path copy = file.string() + kDamaged;
  std::error_code error;
  fs::copy_file(file, copy, fs::copy_options::skip_existing, error);
  log::warn("journal") << run.lost_keyframes << " keyframes are incomplete; a copy of the journal: "
                       << (error ? "not copied, " + error.message() : copy.string());
}

// The run to continue; nullopt if its process ended before the first keyframe.
std::optional<RestoredRun> restore(const RobotOptions& options, const std::string& input) {
  const fs::path file = options.output / kJournal;
  if (!options.resume) return std::nullopt;
  if (is_absent(file)) {
    log::warn("journal") << file.string() << ": no such file: the run starts from the beginning";
    return std::nullopt;
  }
  RestoredRun run = restore_run(file);
  report_damage(file, run);
  if (run.journal.entries == 0) return std::nullopt;
  if (run.robot != options.robot || run.input != input)
    throw std::invalid_argument(file.string() + ": is of robot " + std::to_string(run.robot) +
                                " on " + run.input + ", this is robot " +
                                std::to_string(options.robot) + " on " + input +
                                ": give the options it was started with, or --output");
  if (run.keyframes.empty()) return std::nullopt;
  if (options.graph.empty() && run.final_states() == 0)
    throw std::invalid_argument(file.string() + ": has keyframes but no odometry");
  return run;
}

// The map is written less often than the journal. Names the keyframes of which a former process has
// left no surface.
void report_lost_surface(const fs::path& file, const MapMesh& map, const RestoredRun& run) {
  std::size_t mapped = 0;
  for (const auto& [first, last] : map.seen_by)
    mapped = std::max<std::size_t>(mapped, std::size_t{last} + 1);
  if (mapped >= run.keyframes.size()) return;
  const double lost_s = seconds_between(run.odometry[std::max<std::size_t>(mapped, 1) - 1].stamp,
                                        run.odometry.back().stamp);
  log::warn("journal") << file.string() << ": has the surface of the first " << mapped << " of "
                       << run.keyframes.size()
                       << " keyframes: the map lacks the surface that only the others saw, "
                       << fixed(lost_s, 1) << " s (mapping.mesh_interval_s)";
}

// The map of the former process; nullopt if the file is missing or damaged.
std::optional<ResumedMap> restore_map(const fs::path& folder, const RestoredRun& run) try {
  const fs::path file = folder / kMapFile;
  if (is_absent(file)) {
    log::warn("journal") << file.string() << ": no such file: the map starts from the beginning";
    return std::nullopt;
  }
  MapMesh map = read_map_file(file);
  report_lost_surface(file, map, run);
  return ResumedMap(std::move(map), static_cast<KeyframeIndex>(run.keyframes.size()));
} catch (const InputFileError& error) {
  log::warn("journal") << error.what() << ": the map starts from the beginning";
  return std::nullopt;
}

// A finished run, which has a keyframe.
RestoredRun open_finished(const fs::path& folder, const fs::path& output) {
  const fs::path file = folder / kJournal;
  std::error_code none;
  if (fs::equivalent(folder, output, none))
    throw std::invalid_argument(file.string() + ": is in the folder of --output: give another one");
  RestoredRun run = restore_run(file);
  report_damage(file, run);
  if (run.keyframes.empty())
    throw std::invalid_argument(file.string() + ": that run has no keyframe");
  return run;
}

// Keyframes without an optimised pose follow the last one with such a pose by odometry.
FinishedMap open_finished_map(const RobotOptions& options) {
  RestoredRun run = open_finished(options.localize, options.output);
  FinishedMap map{std::move(run.keyframes), std::move(run.solution.trajectory.T_world_kf)};
  map.T_map_kf.resize(std::min(map.T_map_kf.size(), map.keyframes.size()));
  while (map.T_map_kf.size() < map.keyframes.size()) {
    const KeyframeOdometry& next = run.odometry[map.T_map_kf.size()];
    map.T_map_kf.push_back(map.T_map_kf.empty() ? next.T_odom_kf
                                                : map.T_map_kf.back() * next.T_previous_kf);
  }
  log::info("localization") << map.keyframes.size() << " keyframes of " << options.localize.string()
                            << ": not yet localised";
  return map;
}

// Images up to the end of the run are left out, because the entries of its journal are in order of
// time.
RestoredRun open_run_to_extend(const RobotOptions& options) {
  const fs::path file = options.extend / kJournal;
  RestoredRun run = open_finished(options.extend, options.output);
  if (run.robot != options.robot)
    throw std::invalid_argument(file.string() + ": is of robot " + std::to_string(run.robot) +
                                ": give --robot " + std::to_string(run.robot));
  log::info("journal") << options.extend.string() << " has images up to "
                       << run.odometry.back().stamp << " ns: earlier images are left out";
  return run;
}

// A run of one keyframe without features.
RestoredRun run_of(const KeyframeOdometry& odometry) {
  RestoredRun run;
  run.robot = odometry.id.robot;
  run.odometry.push_back(odometry);
  run.keyframes.push_back({.odometry = {odometry.id, odometry.T_odom_kf, Matrix6::Zero()},
                           .stamp = odometry.stamp,
                           .features = {}});
  return run;
}

// The first keyframe of the map as keyframe 0 of this run. It has no time of this run, no vertical,
// because the map's z is that of the frame, and no features, because MapMatcher has those of the
// whole map.
RestoredRun first_keyframe_of(const FinishedMap& map, RobotId robot) {
  KeyframeOdometry odometry{.id = {robot, 0}};
  odometry.T_odom_kf = odometry.T_previous_kf = map.T_map_kf.front();
  return run_of(odometry);
}

// The origin of the absolute frame as keyframe 0. Its z is up.
RestoredRun datum_keyframe(const AbsoluteFixesConfig& config, RobotId robot) {
  // Verticals deflect from the normal of the ellipsoid by less than 0.5 mrad in most places. A
  // motion capture is levelled by hand.
  const double sigma_rad = config.source == FixSource::kGnss ? 5e-4 : 0.01;
  KeyframeOdometry odometry{.id = {robot, 0}};
  odometry.vertical = Vertical{Eigen::Vector3d::UnitZ(), sigma_rad};
  return run_of(odometry);
}

FixInput open_fixes(const RobotOptions& options, const AbsoluteFixesConfig& config,
                    std::shared_ptr<const RosNetwork> ros,
                    const std::optional<RestoredRun>& restored) {
  if (!options.localize.empty() || extends(options))
    throw std::invalid_argument(
        "absolute_fixes and --localize or --extend: a run has either the frame of fixes or that of "
        "a former run; give absolute_fixes.source=none or leave the option out");
  FixInput input{FixReader(config)};
  if (!config.file.empty()) {
    input.recorded = input.reader.read(config.file);
  } else if (options.is_live) {
    const bool is_gnss = config.source == FixSource::kGnss;
    if (!is_gnss && config.live_type.empty())
      throw std::invalid_argument("absolute_fixes.live_type: name the type of " + config.topic +
                                  ", for example geometry_msgs/msg/PoseStamped");
    constexpr int kKept = 100;
    const std::string type = is_gnss ? "sensor_msgs/msg/NavSatFix" : config.live_type;
    input.live = std::make_unique<LiveBag>(
        std::move(ros), std::vector<RosTopic>{{config.topic, type, RosQos::kSensorData, kKept}});
    for (const ReceivedFix& former : restored ? restored->fixes : std::vector<ReceivedFix>())
      if (const auto fix = input.reader.accept(former)) input.recorded.push_back(*fix);
  } else if (may_be_bag(options.dataset)) {
    input.recorded = input.reader.read(*open_bag(options.dataset));
  } else {
    throw std::invalid_argument("absolute_fixes.topic: " + options.dataset.string() +
                                " is a folder of files without topics: give absolute_fixes.file");
  }
  log::info(AbsoluteFixesConfig::kSection) << "not yet located";
  return input;
}

std::unique_ptr<BagReader> subscribe(std::shared_ptr<const RosNetwork> network,
                                     const SensorTopicNames& topics) {
  return std::make_unique<LiveBag>(std::move(network), live_topics(topics));
}

// Ends the wait for messages when a signal arrives.
class SignalStop {
 public:
  SignalStop(SignalWatch& signals, LiveBag& bag)
      : watcher_([&signals, &bag, this](const std::stop_token& over) {
          constexpr double kInterval_s = 0.1;
          while (!over.stop_requested() && !came_) came_ = signals.wait(kInterval_s).has_value();
          if (came_) bag.stop();
        }) {}

  [[nodiscard]] bool came() const { return came_; }

 private:
  std::atomic<bool> came_ = false;
  std::jthread watcher_;
};

// nullopt: a signal arrived.
std::optional<Rig> receive_calibration(const PartialRig& rig,
                                       const std::shared_ptr<const RosNetwork>& ros,
                                       SignalWatch& signals) {
  constexpr double kPatience_s = 30.0;
  constexpr int kKept = 100;
  std::vector<RosTopic> wanted;
  std::string names;
  for (const auto& source : RigCompletion(rig).sources()) {
    wanted.push_back({source.topic, std::string(source.type),
                      source.type == RosTFMessage::kType ? RosQos::kLatched : RosQos::kSensorData,
                      kKept});
    names += (names.empty() ? "" : ", ") + source.topic;
  }
  LiveBag topics(ros, std::move(wanted));
  log::info("sensors") << "waiting for messages with the calibration: " << names;
  topics.give_up_after(kPatience_s);
  const SignalStop stop(signals, topics);
  try {
    Rig complete = complete_rig("live", topics, rig);
    return stop.came() ? std::nullopt : std::optional(std::move(complete));
  } catch (const DatasetError&) {
    if (stop.came()) return std::nullopt;
    throw;
  }
}

// Completes the calibration of the rig file from messages. nullopt: a signal arrived.
std::optional<Rig> complete(const RobotOptions& options, const PartialRig& rig,
                            const std::shared_ptr<const RosNetwork>& ros, SignalWatch& signals) {
  if (rig.is_complete()) return rig.rig;
  return options.is_live ? receive_calibration(rig, ros, signals)
                         : complete_rig(options.dataset.string(), *open_bag(options.dataset), rig);
}

// Topics of the rig that the configuration uses.
SensorTopicNames used_topics(const RobotOptions& options, const RobotConfig& config,
                             const std::optional<MappingPlan>& mapping, const PartialRig& rig) {
  SensorTopicNames topics = rig.rig.topics;
  const bool has_poses =
      !topics.odometry.empty() || !rig.pose_file.empty() || !options.odometry.empty();
  if (has_poses || !config.sensors.imu) topics.imu = topics.gyro = topics.accel = "";
  if (!options.odometry.empty()) topics.odometry.clear();
  const bool needs_depth =
      topics.right.empty() || config.sensors.depth || (mapping && mapping->reads_depth());
  if (!needs_depth) topics.depth.clear();
  return topics;
}

// Null: a signal arrived. Live sensors are subscribed before the calibration is complete, because a
// driver may wait for its readers.
std::unique_ptr<DatasetReader> open_messages(const RobotOptions& options, const RobotConfig& config,
                                             const std::optional<MappingPlan>& mapping,
                                             const RigInput& input,
                                             std::shared_ptr<const RosNetwork> ros,
                                             std::optional<Stamp> not_before,
                                             SignalWatch& signals) {
  PartialRig partial = *input.messages;
  const SensorTopicNames topics = used_topics(options, config, mapping, partial);
  partial.rig.topics.depth = topics.depth;
  auto messages = options.is_live ? subscribe(ros, topics) : open_bag(options.dataset);
  std::optional<Rig> rig = complete(options, partial, ros, signals);
  if (!rig) return nullptr;
  rig->topics = topics;
  rig->sensors.has_imu = !topics.imu.empty() || !topics.gyro.empty();
  input.correction.apply_to(rig->sensors.stereo);
  const RecordingPart window{.from_s = options.from_s.value_or(0.0),
                             .to_s = options.to_s.value_or(std::numeric_limits<double>::infinity()),
                             .not_before = not_before};
  return std::make_unique<BagDataset>(options.is_live ? "live" : options.dataset.string(),
                                      std::move(messages), *std::move(rig), window);
}

[[noreturn]] void refuse_without_rig(const std::string& bag) {
  const auto reader = open_bag(bag);  // throws if the file is no recording
  const auto is_image = [](const BagChannel& channel) {
    return is_of_type(channel, RosImage::kType) || is_of_type(channel, RosCompressedImage::kType);
  };
  if (std::ranges::none_of(reader->channels(), is_image))
    throw std::invalid_argument(bag +
                                ": no topic of it has images: robots play recordings of "
                                "sensors, not what a robot has published (--record)");
  throw std::invalid_argument(bag +
                              ": --rig FILE must state which of its topics are the sensors; " +
                              "kimera_multi_robot --inspect " + bag + " rig.yaml writes one");
}

// Null: a signal arrived.
std::unique_ptr<DatasetReader> open_dataset(const RobotOptions& options, const RobotConfig& config,
                                            const std::optional<MappingPlan>& mapping,
                                            const RigInput& rig,
                                            std::shared_ptr<const RosNetwork> ros,
                                            const std::optional<RestoredRun>& restored,
                                            SignalWatch& signals) {
  const auto not_before = restored ? std::optional(restored->odometry.back().stamp) : std::nullopt;
  const bool is_bag = has_messages(options);
  if (is_bag && !rig.messages) refuse_without_rig(options.dataset.string());
  if (is_bag)
    return open_messages(options, config, mapping, rig, std::move(ros), not_before, signals);
  FolderOptions folder{
      .part = {.from_s = options.from_s.value_or(0.0),
               .to_s = options.to_s.value_or(std::numeric_limits<double>::infinity()),
               .not_before = not_before},
      .correction = rig.correction,
      .imu = config.sensors.imu && options.odometry.empty(),
      .depth = config.sensors.depth || (mapping && mapping->reads_depth()),
      .labels = config.sensors.labels || (mapping && mapping->reads_labels())};
  const bool has_correction = layout_of(options.dataset) == FolderLayout::kEuroc;
  return std::make_unique<FolderReader>(
      open_folder(options.dataset, folder, has_correction ? fs::path() : options.rig));
}

// Adds the odometry poses of a file if one is named.
std::unique_ptr<DatasetReader> with_poses(const RobotOptions& options, const RigInput& rig,
                                          std::unique_ptr<DatasetReader> reader) {
  const fs::path file =
      options.odometry.empty() && rig.messages ? rig.messages->pose_file : options.odometry;
  if (file.empty()) return reader;
  if (options.is_live)
    throw std::invalid_argument(
        file.string() +
        ": a file of poses is of a recording; --live receives an odometry on "
        "a topic: odometry: {topic: ...} in " +
        options.rig.string());
  ReaderReport faults;
  const UncertainTrajectory poses = read_uncertain_trajectory(
      file, [&](const std::string& fault) { faults.add(ReaderFault::kMalformedRow, fault); });
  return std::make_unique<PoseFileReader>(std::move(reader), file, poses, faults);
}

// Converts the restored camera calibration so that it is relative to the rig as corrected now.
void find_beyond(const CameraCalibration& correction, RestoredRun& run) {
  for (KeyframeOdometry& keyframe : run.odometry)
    if (keyframe.calibration)
      keyframe.calibration->calibration = keyframe.calibration->calibration.without(correction);
}

RecordedGraph open_graph(const RobotOptions& options) {
  RecordedGraph graph = read_recorded_graph(options.graph, options.robot);
  if (graph.indefinite_edges > 0)
    log::warn("graph") << options.graph.string() << ": " << graph.indefinite_edges
                       << " edges have an information matrix that is not positive definite: "
                          "weighed by its blocks";
  return in_space(std::move(graph));
}

}  // namespace

ImageSources image_sources(const fs::path& dataset) {
  if (const FolderLayout layout = layout_of(dataset); layout != FolderLayout::kEuroc)
    return {.place = dataset.string(),
            .right = layout == FolderLayout::kKitti,
            .depth = layout != FolderLayout::kKitti,
            .labels = false,
            .palette = dataset / "label_palette.csv"};
  const fs::path sensors = is_folder(dataset / "mav0") ? dataset / "mav0" : dataset;
  return {.place = sensors.string() + " (cam1, depth0, label0)",
          .right = is_folder(sensors / "cam1"),
          .depth = is_folder(sensors / "depth0"),
          .labels = is_folder(sensors / "label0"),
          .palette = sensors / "label_palette.csv"};
}

ImageSources image_sources(const SensorTopicNames& topics, const fs::path& rig) {
  return {.place = rig.string(),
          .right = !topics.right.empty(),
          .depth = !topics.depth.empty(),
          .labels = false,
          .palette = rig.parent_path() / "label_palette.csv"};
}

std::optional<MappingPlan> plan_mapping(const MappingConfig& config,
                                        const StereoDepthConfig& stereo,
                                        const SegmentationConfig& segmentation,
                                        const std::optional<ImageSources>& sources) {
  if (config.mode == MappingMode::kOff) return std::nullopt;
  if (!sources)
    throw ConfigError("mapping.mode needs images: a robot on --graph has none, set it to off");
  MappingPlan plan;
  plan.sensor = {.depth = depth_source(config.depth, *sources),
                 .labels = LabelsFrom::kNone,
                 .stereo = stereo,
                 .segmentation = segmentation};
  if (config.mode == MappingMode::kMetric) return plan;
  plan.sensor.labels = label_source(config.labels, !segmentation.network.empty(), *sources);
  const bool own_table =
      plan.sensor.labels == LabelsFrom::kNetwork && !segmentation.palette.empty();
  plan.palette = read_palette(own_table ? fs::path(segmentation.palette) : sources->palette);
  return plan;
}

std::optional<double> depth_baseline_m(const RobotOptions& options) {
  if (has_messages(options) || layout_of(options.dataset) != FolderLayout::kEuroc)
    return std::nullopt;
  return read_depth_baseline_m(find_mav0(options.dataset));
}

double depth_sigma_per_m(const StereoRig& rig, const MappingPlan& plan) {
  constexpr double kStereoError_px = 0.36, kDepthImageError_px = 0.125;
  const double error_px = plan.reads_depth() ? kDepthImageError_px : kStereoError_px;
  return error_px / (rig.cameras[0].fx * plan.depth_baseline_m.value_or(rig.baseline_m()));
}

std::vector<RosTopic> live_topics(const SensorTopicNames& names) {
  std::vector<RosTopic> topics;
  for (const auto& [kind, topic, type] : sensor_topics(names))
    topics.push_back({topic, std::string(type), RosQos::kSensorData, kind->queue_size});
  return topics;
}

RigInput read_rig_input(const RobotOptions& options) {
  if (options.rig.empty()) return {};
  if (!has_messages(options)) {  // in other layouts the file is that of the camera
    const bool has_correction = layout_of(options.dataset) == FolderLayout::kEuroc;
    return {std::nullopt, has_correction ? read_rig_correction(options.rig) : CameraCalibration()};
  }
  PartialRig rig = read_rig_file(options.rig);
  const CameraCalibration correction{rig.rig.camera_time_offset_s, rig.T_body_rig};
  return {std::move(rig), correction};
}

std::optional<RobotInput> open_robot_input(const RobotOptions& options, const RobotConfig& config,
                                           const std::optional<MappingPlan>& mapping,
                                           const RigInput& rig, SignalWatch& signals) {
  if (!options.session.empty())
    return RobotInput{
        PastRun(), {}, alone_as(options.robot, open_finished(options.session, options.output))};
  const bool is_dataset = options.is_live || !options.dataset.empty();
  const fs::path& path = options.is_live ? options.rig
                         : is_dataset    ? options.dataset
                                         : options.graph;
  const std::string name = (path / "").parent_path().filename();  // independent of the mount point
  std::optional<RestoredRun> restored =
      extends(options) ? open_run_to_extend(options) : restore(options, name);
  std::shared_ptr<const RosNetwork> ros;
  if (options.is_live || config.ros.publish.value_or(false))
    ros = std::make_shared<const RosNetwork>(config.ros);
  const AbsoluteFixesConfig& absolute = config.absolute_fixes;
  if (!is_dataset && absolute.is_on())
    throw std::invalid_argument(
        "absolute_fixes and --graph: fixes need the odometry of a recording or of --live; give "
        "absolute_fixes.source=none");
  if (!is_dataset)
    return RobotInput{.source = open_graph(options),
                      .name = name,
                      .restored = std::move(restored),
                      .ros = std::move(ros)};
  std::optional<FixInput> fixes;
  if (absolute.is_on()) fixes = open_fixes(options, absolute, ros, restored);
  auto reader = open_dataset(options, config, mapping, rig, ros, restored, signals);
  if (reader == nullptr) return std::nullopt;
  reader = with_poses(options, rig, std::move(reader));
  RobotInput input{.source = std::move(reader), .name = name};
  if (restored && mapping)
    input.map = restore_map(extends(options) ? options.extend : options.output, *restored);
  if (restored) find_beyond(rig.correction, *restored);
  input.restored = std::move(restored);
  input.ros = std::move(ros);
  input.rig_correction = rig.correction;
  if (!options.localize.empty()) input.localize_in = open_finished_map(options);
  if (extends(options)) input.restored_from = RestoredFrom::kFormerRun;
  if (input.localize_in && !input.restored) {
    input.restored_from = RestoredFrom::kFinishedMap;
    input.restored = first_keyframe_of(*input.localize_in, options.robot);
  }
  // Keyframe 0 of a run with an absolute frame is its origin, without a time of the run.
  if (fixes && input.restored && input.restored->odometry.front().stamp != 0)
    throw std::invalid_argument(
        options.output.string() +
        ": that run began without absolute_fixes: resume it with absolute_fixes.source=none");
  input.fixes = std::move(fixes);
  if (input.fixes && !input.restored) {
    input.restored_from = RestoredFrom::kDatum;
    input.restored = datum_keyframe(absolute, options.robot);
  }
  return input;
}

}  // namespace km
