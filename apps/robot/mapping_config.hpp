#pragma once

#include "modules/core/config.hpp"

namespace km {

/// What a robot makes of its images beside its trajectory.
enum class MappingMode {
  kOff,       ///< Nothing.
  kMetric,    ///< A mesh.
  kSemantic,  ///< A mesh with labels.
};

/// Where depth, or labels, of all pixels come from.
enum class DenseSource {
  kAuto,      ///< The recording's images where it has them, else computed.
  kRecorded,  ///< The recording's images.
  kComputed,  ///< Stereo matching; the network of `segmentation:`.
};

/// Parameters of a robot's map that are not those of a module.
struct MappingConfig {
  static constexpr const char* kSection = "mapping";

  MappingMode mode = MappingMode::kOff;
  DenseSource depth = DenseSource::kAuto;
  DenseSource labels = DenseSource::kAuto;
  double rate_hz = 5.0;
  double max_depth_error_m = 0.2;
  double mesh_interval_s = 3.0;

  void visit_fields(auto& visitor) {
    visitor.field(
        "mode", mode,
        {{"off", MappingMode::kOff},
         {"metric", MappingMode::kMetric},
         {"semantic", MappingMode::kSemantic}},
        "what is made of the images beside the trajectory: nothing, a mesh, a mesh with labels");
    visitor.field("depth", depth,
                  {{"auto", DenseSource::kAuto},
                   {"recorded", DenseSource::kRecorded},
                   {"stereo", DenseSource::kComputed}},
                  "auto: the recording's images where it has them, else computed");
    visitor.field("labels", labels,
                  {{"auto", DenseSource::kAuto},
                   {"recorded", DenseSource::kRecorded},
                   {"network", DenseSource::kComputed}},
                  "likewise; network: that of segmentation");
    visitor.field("rate_hz", rate_hz, {0.01, 100.0},
                  "[1/s] frames that go into the map, by their stamps; a mapper too slow for it "
                  "leaves some out, at --rate max it holds the others up");
    visitor.field("max_depth_error_m", max_depth_error_m, {0.001, 100.0},
                  "[m] standard deviation expected of depths: larger stay out; beyond half of "
                  "semantic_mapping's truncation surfaces come out torn; an error is a quarter of "
                  "a pixel of disparity, see usable_range_m()");
    visitor.field("mesh_interval_s", mesh_interval_s, {0.1, 3600.0},
                  "[s] between meshes: to be corrected, and written to files");
  }
};

}  // namespace km
