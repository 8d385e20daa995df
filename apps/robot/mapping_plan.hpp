#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/robot/robot_config.hpp"
#include "modules/core/camera.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/sensors/bag_dataset.hpp"

namespace km {

/// Sources of depth and labels for the map of a robot.
struct MappingPlan {
  DenseSensorConfig sensor;
  LabelPalette palette;  ///< Empty without labels.

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

/// Standard deviation of a depth of `rig` over the square of the depth [1/m], if that of a
/// disparity is a quarter of a pixel: 0.25 px / (f * baseline). With an RGB-D rig the baseline is
/// the virtual one, see rgbd_rig(). With stereo cameras, depth images are assumed to be no better
/// than stereo depth.
[[nodiscard]] double depth_sigma_per_m(const StereoRig& rig);

/// Distance at which the standard deviation of the depth of `rig` is `max_error_m`.
[[nodiscard]] double usable_range_m(const StereoRig& rig, double max_error_m);

}  // namespace km
