#pragma once

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
  double depth_sigma_per_m = 0.003;
  double max_weight = 100.0;
  double min_weight = 0.05;
  double label_confidence = 0.8;
  double min_label_probability = 0.0;
  double window_m = 8.0;
  int max_blocks = 20000;

  void visit_fields(auto& visitor) {
    visitor.field(
        "voxel_size_m", voxel_size_m, {0.005, 1.0},
        "[m] side of a voxel; half of it: about four times the memory, time and triangles");
    visitor.field("truncation_voxels", truncation_voxels, {2.0, 16.0},
                  "[voxels] kept on both sides of a surface: thinner walls seen from both sides "
                  "eat into each other; below three times the depth error surfaces come out torn");
    visitor.field("min_range_m", min_range_m, {0.0, 10.0},
                  "[m along the optical axis] nearest depth used");
    visitor.field("max_range_m", max_range_m, {0.5, 65.0}, "[m] farthest depth used");
    visitor.field("carving", carving,
                  "space between camera and surface is free: what is seen through is removed");
    visitor.field(
        "depth_sigma_m", depth_sigma_m, {1e-4, 1.0},
        "[m] of depth z the standard deviation is sqrt(depth_sigma_m^2 + (depth_sigma_per_m "
        "z^2)^2); a measurement weighs depth_sigma_m^2 over its square");
    visitor.field("depth_sigma_per_m", depth_sigma_per_m, {0.0, 1.0},
                  "[1/m] of stereo with focal length f [px], baseline b [m] and matches good to s "
                  "px: s / (f b)");
    visitor.field("max_weight", max_weight, {1.0, 10000.0},
                  "sum at which a voxel forgets the old as it learns the new: lower follows "
                  "changes sooner, higher averages more");
    visitor.field("min_weight", min_weight, {0.0, 10000.0},
                  "sum above which surface is meshed: a few wrong depths stay out; at 0.05 and the "
                  "errors above, one look suffices up to 3.8 m, at 6 m it takes six; 0: all");
    visitor.field(
        "label_confidence", label_confidence, {0.5, 0.9999},
        "that a pixel's label is right; the rest is spread evenly over the other classes");
    visitor.field("min_label_probability", min_label_probability, {0.0, 1.0},
                  "of the best label of a vertex: less is unknown");
    visitor.field(
        "window_m", window_m, {0.1, 1e6},
        "[m] of way during which the surface of a block was not seen: it becomes final mesh, is "
        "forgotten, and mapped anew on return; odometry should drift by less than a voxel on it");
    visitor.field("max_blocks", max_blocks, {64, 4000000},
                  "of 8 x 8 x 8 voxels, 8.5 kB each, 15 kB with surface; beyond it those unseen "
                  "for longest become final mesh");
  }
};

}  // namespace km
