#include "apps/robot/mapping_plan.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/core/input_file.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

fs::path sensor_folder(const fs::path& dataset) {
  return is_folder(dataset / "mav0") ? dataset / "mav0" : dataset;
}

DepthFrom depth_source(DenseSource wanted, const fs::path& sensors) {
  const bool recorded = is_folder(sensors / "depth0");
  const bool stereo = is_folder(sensors / "cam1");
  if (wanted == DenseSource::kRecorded && !recorded)
    throw ConfigError("mapping.depth: recorded, but there is no depth0 in " + sensors.string() +
                      "; stereo computes it");
  if (wanted == DenseSource::kComputed && !stereo)
    throw ConfigError("mapping.depth: stereo, but there is no cam1 in " + sensors.string());
  return recorded && wanted != DenseSource::kComputed ? DepthFrom::kImages : DepthFrom::kStereo;
}

LabelsFrom label_source(DenseSource wanted, bool has_network, const fs::path& sensors) {
  const bool recorded = is_folder(sensors / "label0");
  if (wanted == DenseSource::kRecorded && !recorded)
    throw ConfigError("mapping.labels: recorded, but there is no label0 in " + sensors.string());
  if (wanted == DenseSource::kComputed && !has_network)
    throw ConfigError("mapping.labels: network, but segmentation.network names no file");
  if (!recorded && !has_network)
    throw ConfigError("mapping.mode: semantic needs labels, but there is no label0 in " +
                      sensors.string() +
                      " and segmentation.network names no file; metric does without");
  return recorded && wanted != DenseSource::kComputed ? LabelsFrom::kImages : LabelsFrom::kNetwork;
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

std::optional<MappingPlan> plan_mapping(const MappingConfig& config,
                                        const StereoDepthConfig& stereo,
                                        const SegmentationConfig& segmentation,
                                        const fs::path& dataset) {
  if (config.mode == MappingMode::kOff) return std::nullopt;
  if (dataset.empty())
    throw ConfigError("mapping.mode needs images: a robot on --graph has none, set it to off");
  const fs::path sensors = sensor_folder(dataset);
  MappingPlan plan;
  plan.sensor = {.depth = depth_source(config.depth, sensors),
                 .labels = LabelsFrom::kNone,
                 .stereo = stereo,
                 .segmentation = segmentation};
  if (config.mode == MappingMode::kMetric) return plan;
  plan.sensor.labels = label_source(config.labels, !segmentation.network.empty(), sensors);
  const bool own_table =
      plan.sensor.labels == LabelsFrom::kNetwork && !segmentation.palette.empty();
  plan.palette =
      read_palette(own_table ? fs::path(segmentation.palette) : sensors / "label_palette.csv");
  return plan;
}

double usable_range_m(const StereoRig& rig, double max_error_m) {
  constexpr double kDisparityError_px = 0.25;
  return std::sqrt(max_error_m * rig.cameras[0].fx * rig.baseline_m() / kDisparityError_px);
}

}  // namespace km
