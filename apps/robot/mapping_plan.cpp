#include "apps/robot/mapping_plan.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/core/input_file.hpp"
#include "modules/sensors/folder_layouts.hpp"
#include "modules/sensors/text_file.hpp"

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

double depth_sigma_per_m(const StereoRig& rig) {
  constexpr double kDisparityError_px = 0.25;
  return kDisparityError_px / (rig.cameras[0].fx * rig.baseline_m());
}

double usable_range_m(const StereoRig& rig, double max_error_m) {
  return std::sqrt(max_error_m / depth_sigma_per_m(rig));
}

}  // namespace km
