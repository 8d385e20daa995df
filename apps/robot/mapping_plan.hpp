#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/robot/mapping_config.hpp"
#include "modules/core/camera.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/sensors/bag_dataset.hpp"

namespace km {

/// How a robot comes by depth and labels for its map.
struct MappingPlan {
  DenseSensorConfig sensor;
  LabelPalette palette;  ///< Empty without labels.

  [[nodiscard]] bool reads_depth() const { return sensor.depth == DepthFrom::kImages; }
  [[nodiscard]] bool reads_labels() const { return sensor.labels == LabelsFrom::kImages; }
};

/// What a map can be made of.
struct ImageSources {
  std::string place;  ///< Where they are, for messages: a folder, or a file of topics.
  bool right = false;
  bool depth = false;
  bool labels = false;
  std::filesystem::path palette;  ///< File of the labels' classes, also where labels are computed.
};

/// Those of a EuRoC folder, by what is in it.
[[nodiscard]] ImageSources image_sources(const std::filesystem::path& dataset);

/// Those of a bag or a live robot: no labels.
[[nodiscard]] ImageSources image_sources(const SensorTopicNames& topics,
                                         const std::filesystem::path& rig);

/// What `config` asks for, with the sources that there are (nullopt: no images at all); nullopt if
/// mapping is off. Throws ConfigError if it cannot be had, with what can.
[[nodiscard]] std::optional<MappingPlan> plan_mapping(const MappingConfig& config,
                                                      const StereoDepthConfig& stereo,
                                                      const SegmentationConfig& segmentation,
                                                      const std::optional<ImageSources>& sources);

/// Distance at which the depth of `rig` is off by `max_error_m`, one standard deviation, if its
/// disparities are by a quarter of a pixel: sqrt(max_error_m * f * baseline / 0.25 px). With an
/// RGB-D rig the baseline is the virtual one, see rgbd_rig(); beside stereo cameras depth images
/// are taken to be no better than theirs.
[[nodiscard]] double usable_range_m(const StereoRig& rig, double max_error_m);

}  // namespace km
