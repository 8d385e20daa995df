#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/robot/robot_config.hpp"
#include "modules/absolute_fixes/node/fixes_node.hpp"
#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/camera_calibration.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/journal/restored_run.hpp"
#include "modules/localization/map_matcher.hpp"
#include "modules/mesh/resumed_map.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"
#include "modules/sensors/bag_dataset.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/rig_completion.hpp"
#include "runtime/ros/ros_network.hpp"
#include "runtime/ros/ros_subscription.hpp"
#include "runtime/signal_watch.hpp"

namespace km {

/// Sources of depth and labels for the map of a robot.
struct MappingPlan {
  DenseSensorConfig sensor;
  LabelPalette palette;  ///< Empty without labels.
  /// Baseline of a stereo camera with the errors of the depth images; absent: that of the rig.
  std::optional<double> depth_baseline_m = {};

  [[nodiscard]] bool reads_depth() const { return sensor.depth == DepthFrom::kImages; }
  [[nodiscard]] bool reads_labels() const { return sensor.labels == LabelsFrom::kImages; }
};

/// Image sources from which a map can be built.
struct ImageSources {
  std::string place;  ///< Location for messages: a folder, or a file of topics.
  bool right = false;
  bool depth = false;
  bool labels = false;
  std::filesystem::path palette;  ///< File of the label classes, used also for computed labels.
};

/// Image sources of a folder, by its layout and its contents.
[[nodiscard]] ImageSources image_sources(const std::filesystem::path& dataset);

/// Image sources of a bag or of live sensors: no labels.
[[nodiscard]] ImageSources image_sources(const SensorTopicNames& topics,
                                         const std::filesystem::path& rig);

/// Plan for the map that `config` requests, with the available `sources` (nullopt: no images at
/// all). Returns nullopt if mapping is off. Throws ConfigError that lists the possible values if
/// the request cannot be met.
[[nodiscard]] std::optional<MappingPlan> plan_mapping(const MappingConfig& config,
                                                      const StereoDepthConfig& stereo,
                                                      const SegmentationConfig& segmentation,
                                                      const std::optional<ImageSources>& sources);

/// The baseline_m of the depth images beside a stereo pair in EuRoC's layout, nullopt for other
/// inputs. Throws DatasetError.
[[nodiscard]] std::optional<double> depth_baseline_m(const RobotOptions& options);

/// Standard deviation of a depth over the square of the depth [1/m]: e / (f * baseline). For stereo
/// depth, e is 0.36 px, the rms error of StereoDepth below one pixel in rendered images. For depth
/// images, e is an eighth of a pixel, the step of structured light.
[[nodiscard]] double depth_sigma_per_m(const StereoRig& rig, const MappingPlan& plan);

/// No input: the robot of a finished run stands still and serves the others.
struct PastRun {};

/// Origin of the restored run.
enum class RestoredFrom {
  kFormerProcess,  ///< This run, which a former process began.
  kFormerRun,      ///< A run that this run extends. The robot was moved in between.
  kFinishedMap,    ///< Keyframe 0 of the map in which this run localises itself.
  kDatum,          ///< Keyframe 0 is the origin of the absolute frame of fixes.
};

/// Input of the robot: a recording of sensors or a recorded pose graph, and the restored run if
/// there is one.
struct RobotInput {
  std::variant<std::unique_ptr<DatasetReader>, RecordedGraph, PastRun> source;
  std::string name;  ///< For the journal.
  std::optional<RestoredRun> restored = {};
  RestoredFrom restored_from = RestoredFrom::kFormerProcess;
  std::optional<FinishedMap> localize_in = {};
  std::optional<FixInput> fixes = {};
  std::optional<ResumedMap> map = {};  ///< Map of the restored run; absent without mapping.
  std::shared_ptr<const RosNetwork> ros =
      nullptr;  ///< Null unless the robot reads or publishes topics of ROS.
  CameraCalibration rig_correction = {};  ///< Correction already applied to the rig of the sensors.
};

/// Content of the --rig file. A EuRoC folder has its own calibration, to which only a correction
/// applies.
struct RigInput {
  std::optional<PartialRig> messages;  ///< Rig of sensors that come as messages.
  CameraCalibration correction;        ///< Correction of the calibration.
};

/// Subscriptions to the topics of live sensors.
[[nodiscard]] std::vector<RosTopic> live_topics(const SensorTopicNames& names);

/// Throws ConfigError and DatasetError, see read_rig_file() and read_rig_correction().
[[nodiscard]] RigInput read_rig_input(const RobotOptions& options);

/// Opens the input that the options name, with --resume the journal of the run to continue, and
/// with
/// --localize that of the finished run.
/// nullopt: one of `signals` arrived during the wait for the calibration from live topics. Throws
/// DatasetError, DdsError, InputFileError and std::invalid_argument with one line that names the
/// file and a remedy.
[[nodiscard]] std::optional<RobotInput> open_robot_input(const RobotOptions& options,
                                                         const RobotConfig& config,
                                                         const std::optional<MappingPlan>& mapping,
                                                         const RigInput& rig, SignalWatch& signals);

}  // namespace km
