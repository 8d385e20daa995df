#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of SemanticMapper. Field names are the YAML keys below `semantic_mapping:`.
struct SemanticMappingConfig {
  static constexpr const char* kSection = "semantic_mapping";

  /// Side of a voxel. Half of it: about four times the memory, time and triangles.
  double voxel_size_m = 0.10;

  /// Distances are kept up to so many voxels on both sides of a surface. Walls thinner than this
  /// seen from both sides eat into each other; below about three times the depth error at the
  /// usual range, surfaces come out torn.
  double truncation_voxels = 4.0;

  /// Depths along the optical axis that are used; others count as none.
  double min_range_m = 0.3;
  double max_range_m = 10.0;

  /// What is seen through is removed: space between camera and surface counts as free.
  bool carving = true;

  /// Standard deviation of depth z: sqrt(constant^2 + (quadratic z^2)^2). Stereo with focal length
  /// f [px], baseline b [m] and matches good to s px has the quadratic part s / (f b). A
  /// measurement weighs constant^2 over that variance: 1 near the camera, as 1 / z^4 far away.
  double depth_sigma_m = 0.01;
  double depth_sigma_per_m = 0.003;

  /// Sum of weights at which a voxel forgets the old as it learns the new. Lower follows changes
  /// sooner, higher averages more.
  double max_weight = 100.0;

  /// Surface is meshed where the weights sum up to more than this: what a few wrong depths put into
  /// the air stays out. With the depth errors below one look suffices up to 3.8 m, at 6 m it takes
  /// six. 0: all that was ever seen.
  double min_weight = 0.05;

  /// Probability that a pixel's label is right; the rest is spread evenly over the other classes.
  double label_confidence = 0.8;

  /// Vertices whose best label is less probable than this are unknown (0).
  double min_label_probability = 0.0;

  /// A block of voxels whose surface was not seen while the camera went so far [m] becomes final
  /// mesh and is forgotten: who comes back maps the place anew, with its own keyframes. On that way
  /// odometry should drift by less than a voxel; what differs by more cannot be parted again once
  /// it is fused.
  double window_m = 8.0;

  /// Blocks of 8 x 8 x 8 voxels kept at most (8.5 kB each, 15 kB where there is surface); beyond it
  /// those unseen for longest become final mesh.
  int max_blocks = 20000;

  void visit_fields(auto& visitor) {
    visitor.field("voxel_size_m", voxel_size_m, {0.005, 1.0}, "[m]");
    visitor.field("truncation_voxels", truncation_voxels, {2.0, 16.0}, "[voxels] on both sides");
    visitor.field("min_range_m", min_range_m, {0.0, 10.0}, "[m] nearest depth used");
    visitor.field("max_range_m", max_range_m, {0.5, 65.0}, "[m] farthest depth used");
    visitor.field("carving", carving, "remove what is seen through");
    visitor.field("depth_sigma_m", depth_sigma_m, {1e-4, 1.0}, "[m] constant part");
    visitor.field("depth_sigma_per_m", depth_sigma_per_m, {0.0, 1.0}, "[1/m] times squared depth");
    visitor.field("max_weight", max_weight, {1.0, 10000.0}, "of a voxel");
    visitor.field("min_weight", min_weight, {0.0, 10000.0}, "of meshed surface");
    visitor.field("label_confidence", label_confidence, {0.5, 0.9999}, "that a label is right");
    visitor.field("min_label_probability", min_label_probability, {0.0, 1.0}, "less is unknown");
    visitor.field("window_m", window_m, {0.1, 1e6}, "[m] of way unseen: final");
    visitor.field("max_blocks", max_blocks, {64, 4000000}, "of 8 x 8 x 8 voxels");
  }
};

}  // namespace km
