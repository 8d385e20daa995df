#pragma once

#include <optional>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of SemanticMapper.
struct SemanticMappingConfig {
  static constexpr const char* kSection = "semantic_mapping";

  double voxel_size_m = 0.10;
  double truncation_voxels = 4.0;
  double min_range_m = 0.3;
  double max_range_m = 10.0;
  bool carving = true;
  double depth_sigma_m = 0.01;
  std::optional<double> depth_sigma_per_m = {};
  double max_weight = 100.0;
  double min_weight = 0.05;
  double label_confidence = 0.8;
  double min_label_probability = 0.0;
  double window_m = 8.0;
  int max_blocks = 20000;

  /// depth_sigma_per_m if there is none: that of usual RGB-D cameras.
  static constexpr double kDepthSigma_per_m = 0.003;

  void visit_fields(auto& visitor) {
    visitor.field(
        "voxel_size_m", voxel_size_m, {0.005, 1.0},
        "[m] side of a voxel; half of it needs about four times the memory, time and triangles");
    visitor.field(
        "truncation_voxels", truncation_voxels, {2.0, 16.0},
        "[voxels] truncation distance on both sides of a surface; the two sides of a thinner wall "
        "damage each other; below three times the depth error, surfaces get holes");
    visitor.field("min_range_m", min_range_m, {0.0, 10.0},
                  "[m along the optical axis] smallest depth that is used");
    visitor.field("max_range_m", max_range_m, {0.5, 65.0}, "[m] largest depth that is used");
    visitor.field("carving", carving,
                  "removes surface in the free space between camera and observed surface");
    visitor.field("depth_sigma_m", depth_sigma_m, {1e-4, 1.0},
                  "[m] standard deviation of depth z is sqrt(depth_sigma_m^2 + (depth_sigma_per_m "
                  "z^2)^2); a measurement has the weight depth_sigma_m^2 divided by its square");
    visitor.field(
        "depth_sigma_per_m", depth_sigma_per_m, {0.0, 1.0},
        "[1/m] s / (f b) for stereo with focal length f [px], baseline b [m] and a "
        "matching error of s px; left out: that of a quarter of a pixel for stereo depth, "
        "0.003 for depth images");
    visitor.field("max_weight", max_weight, {1.0, 10000.0},
                  "bound on the sum of weights of a voxel; lower values follow changes faster, "
                  "higher values average more");
    visitor.field("min_weight", min_weight, {0.0, 10000.0},
                  "smallest sum of weights of meshed surface; excludes a few wrong depths. At 0.05 "
                  "and the standard deviations above, one frame suffices up to 3.8 m, at 6 m six "
                  "are needed; 0: no bound");
    visitor.field(
        "label_confidence", label_confidence, {0.5, 0.9999},
        "probability that a pixel's label is right; the other classes share the rest equally");
    visitor.field(
        "min_label_probability", min_label_probability, {0.0, 1.0},
        "smallest probability of the best label of a vertex; below it the label is unknown");
    visitor.field("window_m", window_m, {0.1, 1e6},
                  "[m] distance travelled after which an unseen block becomes final mesh and its "
                  "voxels are discarded; on return it is mapped again; the drift of odometry over "
                  "this distance should be less than a voxel");
    visitor.field("max_blocks", max_blocks, {64, 4000000},
                  "largest number of blocks of 8 x 8 x 8 voxels, 8.5 kB each, 15 kB with surface; "
                  "beyond it the blocks unseen for longest become final mesh");
  }
};

}  // namespace km
