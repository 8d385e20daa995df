#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/robot/mapping_config.hpp"
#include "apps/robot/run_config.hpp"
#include "modules/absolute_fixes/absolute_fixes_config.hpp"
#include "modules/constellations/constellations_config.hpp"
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
#include "modules/pose_graph/pose_graph_config.hpp"
#include "modules/recorded_graph/graph_playback_config.hpp"
#include "modules/semantic_mapping/semantic_mapping_config.hpp"
#include "modules/sensors/playback_pace.hpp"
#include "modules/sensors/sensors_config.hpp"
#include "modules/view/view_config.hpp"
#include "modules/vio/tracker_config.hpp"
#include "modules/vio/vio_config.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/ros_config.hpp"

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
  std::filesystem::path fallback;               ///< Folder for results that `output` cannot take.
  bool resume = false;                          ///< Continue the run whose results are in `output`.
  std::optional<std::filesystem::path> record;  ///< MCAP file for viewers; empty: in `output`.
  bool record_images = false;                   ///< Record the left images, too.
  bool view = false;             ///< Send the state of the robot to viewers in the domain.
  double serve_limit_s = 120.0;  ///< Longest time to serve peers after the input has ended.
  std::string log_level = "info";
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
  ConstellationsConfig constellations;
  ViewConfig view;

  std::string effective;  ///< YAML text of a file with this configuration.

  /// Calls visit(section) for every section, in the order of files.
  void visit_sections(const auto& visit) {
    const auto visit_all = [&](auto&... sections) { (visit(sections), ...); };
    visit_all(run, dds, budget, sensors, ros, tracker, vio, keyframe_features, place_recognition,
              loop_closure, pcm, pose_graph, absolute_fixes, graph_playback, mapping, stereo_depth,
              segmentation, semantic_mapping, mesh_deformation, map_2d, map, objects,
              constellations, view);
  }
};

/// Configuration from the link profile, then --config files, then --set, then the other options of
/// the command line; a later source overrides an earlier one. Throws ConfigError with every
/// problem, by file and line.
[[nodiscard]] RobotConfig load_robot_config(const RobotOptions& options);

/// Path of a file that comes with the program, such as "vocabulary/indoor.kmvoc" or
/// "qos/wifi.yaml". Tries `name` as it is, then below config/ of the source tree or of the
/// installation from which this program runs. Throws ConfigError that names `key`, whose value
/// `name` is, and all places that were tried.
[[nodiscard]] std::filesystem::path find_shipped_file(const std::string& name, const char* key);

}  // namespace km
