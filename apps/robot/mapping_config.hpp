#pragma once

#include "modules/core/config.hpp"

namespace km {

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
  double max_depth_error_m = 0.2;
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
                  "[m] largest expected standard deviation of depths that are used; beyond half of "
                  "semantic_mapping's truncation surfaces have holes and steps; the standard "
                  "deviation follows from a quarter of a pixel of disparity, see usable_range_m()");
    visitor.field("mesh_interval_s", mesh_interval_s, {0.1, 3600.0},
                  "[s] interval between meshes, which are corrected and written to files");
  }
};

}  // namespace km
