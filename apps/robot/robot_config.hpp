#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/absolute_fixes/absolute_fixes_config.hpp"
#include "modules/core/config.hpp"
#include "modules/core/ids.hpp"
#include "modules/dense_sensing/segmentation_config.hpp"
#include "modules/dense_sensing/stereo_depth_config.hpp"
#include "modules/loop_closure/keyframe_features_config.hpp"
#include "modules/loop_closure/loop_closure_config.hpp"
#include "modules/map_2d/map_2d_config.hpp"
#include "modules/mesh/map_sharing_config.hpp"
#include "modules/mesh_deformation/mesh_deformation_config.hpp"
#include "modules/objects/objects_config.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"
#include "modules/place_recognition/place_recognition_config.hpp"
#include "modules/recorded_graph/graph_playback_config.hpp"
#include "modules/semantic_mapping/semantic_mapping_config.hpp"
#include "modules/sensors/sensors_config.hpp"
#include "modules/session/pose_graph_config.hpp"
#include "modules/view/view_config.hpp"
#include "modules/vio/tracker_config.hpp"
#include "modules/vio/vio_config.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/ros/ros_config.hpp"

namespace km {

/// The command line of kimera_multi_robot.
struct RobotOptions {
  std::vector<std::filesystem::path> configs;  ///< In order; a later file overrides an earlier one.
  std::vector<std::string> settings;           ///< section.key=value, over all files.
  RobotId robot = 0;
  std::string name;  ///< "robot<id>" if not given.

  std::filesystem::path dataset;   ///< EuRoC/ASL folder, or a bag; exclusive with `graph`.
  std::filesystem::path rig;       ///< File that names the sensor topics of a bag (see RigFile).
  std::filesystem::path odometry;  ///< Poses of another odometry, which replaces the robot's own.
  bool is_live = false;            ///< True if drivers that run now publish the topics of `rig`.
  std::filesystem::path graph;     ///< Recorded pose graph: g2o, CSV or JRL.
  std::filesystem::path session;   ///< Results of a finished run; exclusive with dataset and graph.
  std::filesystem::path localize;  ///< Results of a finished run: this run localises in its map.
  std::filesystem::path extend;    ///< Results of a finished run that this run extends.
  std::optional<double> from_s;    ///< Part of the recording [s since its first image].
  std::optional<double> to_s;
  PlaybackPace pace;  ///< Not used if `is_live`.

  std::optional<int> domain;  ///< DDS domain; from the configuration if absent.
  std::string link;           ///< Name or file of a link profile; from the configuration if empty.
  std::vector<std::string> peers;
  std::string interface_name;
  std::filesystem::path
      security;  ///< Folder of this robot's keys; if given, messages are encrypted and signed.

  std::filesystem::path output;
  bool resume = false;                          ///< Continue the run whose results are in `output`.
  std::optional<std::filesystem::path> record;  ///< MCAP file for viewers; empty: in `output`.
  bool record_images = false;                   ///< Record the left images, too.
  bool view = false;  ///< Send the state of the robot to viewers in the domain.
  /// Longest time to serve peers after the input has ended. It is longer than
  /// PoseGraphConfig::session_wait_s, after which the last session comes at the latest.
  double serve_limit_s = 300.0;
  std::string log_level = "info";
};

/// Parameters of a robot that belong to no module.
struct RunConfig {
  static constexpr const char* kSection = "run";

  std::string vocabulary = "vocabulary/indoor.kmvoc";
  std::string link = "wired";
  double settle_s = 3.0;
  double patience = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("vocabulary", vocabulary,
                  "vocabulary of place recognition: a file, or one that comes with the program");
    visitor.field("link", link,
                  "link profile, see config/qos: wired, wifi, intermittent, or a file");
    visitor.field(
        "settle_s", settle_s, {0.1, 600.0},
        "[s] the robot leaves when it and all present peers have been idle for this time");
    visitor.field("patience", patience, {0.1, 100.0},
                  "increase on slow computers: factor on the time limit for one step of a module "
                  "(120 s; objects, and files of meshes and of the record: 300 s); a module that "
                  "exceeds its limit counts as hung, and the robot ends without it");
  }
};

/// Map that a robot builds from its images.
enum class MappingMode {
  kOff,       ///< Nothing.
  kMetric,    ///< A mesh.
  kSemantic,  ///< A mesh with labels.
};

/// Source of the depths, or labels, of all pixels.
enum class DenseSource {
  kAuto,      ///< Images of the recording if it has them, else computed.
  kRecorded,  ///< Images of the recording.
  kComputed,  ///< Stereo matching; the network of `segmentation:`.
};

/// Parameters of a robot's map that belong to no module.
struct MappingConfig {
  static constexpr const char* kSection = "mapping";

  MappingMode mode = MappingMode::kOff;
  DenseSource depth = DenseSource::kAuto;
  DenseSource labels = DenseSource::kAuto;
  double rate_hz = 5.0;
  double max_depth_error_m = 0.5;
  double mesh_interval_s = 3.0;

  void visit_fields(auto& visitor) {
    visitor.field("mode", mode,
                  {{"off", MappingMode::kOff},
                   {"metric", MappingMode::kMetric},
                   {"semantic", MappingMode::kSemantic}},
                  "map to build from the images: none, a mesh, or a mesh with labels");
    visitor.field("depth", depth,
                  {{"auto", DenseSource::kAuto},
                   {"recorded", DenseSource::kRecorded},
                   {"stereo", DenseSource::kComputed}},
                  "auto: the recording's images if it has them, else computed");
    visitor.field("labels", labels,
                  {{"auto", DenseSource::kAuto},
                   {"recorded", DenseSource::kRecorded},
                   {"network", DenseSource::kComputed}},
                  "auto: the recording's images if it has them, else computed; network: the one of "
                  "segmentation");
    visitor.field("rate_hz", rate_hz, {0.01, 100.0},
                  "[1/s] frames that go into the map, by their stamps; a mapper that is too slow "
                  "skips frames, except at --rate auto and max, where the recording waits for it");
    visitor.field("max_depth_error_m", max_depth_error_m, {0.001, 100.0},
                  "[m] largest expected standard deviation of depths that are used; see "
                  "semantic_mapping.depth_sigma_per_m");
    visitor.field("mesh_interval_s", mesh_interval_s, {0.1, 3600.0},
                  "[s] interval between meshes, which are corrected and written to files");
  }
};

/// The configuration of every module of a robot.
struct RobotConfig {
  RunConfig run;
  DdsConfig dds;
  BudgetConfig budget;
  SensorsConfig sensors;
  RosConfig ros;
  TrackerConfig tracker;
  VioConfig vio;
  KeyframeFeaturesConfig keyframe_features;
  PlaceRecognitionConfig place_recognition;
  LoopClosureConfig loop_closure;
  PcmConfig pcm;
  PoseGraphConfig pose_graph;
  AbsoluteFixesConfig absolute_fixes;
  GraphPlaybackConfig graph_playback;
  MappingConfig mapping;
  StereoDepthConfig stereo_depth;
  SegmentationConfig segmentation;
  SemanticMappingConfig semantic_mapping;
  MeshDeformationConfig mesh_deformation;
  Map2dConfig map_2d;
  MapSharingConfig map;
  ObjectsConfig objects;
  ViewConfig view;

  std::string effective;  ///< YAML text of a file with this configuration.

  /// Calls visit(section) for every section, in the order of files.
  void visit_sections(const auto& visit) {
    const auto visit_all = [&](auto&... sections) { (visit(sections), ...); };
    visit_all(run, dds, budget, sensors, ros, tracker, vio, keyframe_features, place_recognition,
              loop_closure, pcm, pose_graph, absolute_fixes, graph_playback, mapping, stereo_depth,
              segmentation, semantic_mapping, mesh_deformation, map_2d, map, objects, view);
  }
};

/// Configuration from the link profile, then --config files, then --set, then the other options of
/// the command line; a later source overrides an earlier one. Throws ConfigError with every
/// problem, by file and line.
[[nodiscard]] RobotConfig load_robot_config(const RobotOptions& options);

}  // namespace km
