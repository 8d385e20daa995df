#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of optimize_mesh(), MeshCorrector and MeshDeformationNode.
struct MeshDeformationConfig {
  static constexpr const char* kSection = "mesh_deformation";

  double node_spacing_m = 0.5;
  int time_window_keyframes = 15;
  int duplicate_faces = 100'000;
  int seen_through_views = 3;
  double period_s = 2.0;

  void visit_fields(auto& visitor) {
    visitor.field("node_spacing_m", node_spacing_m, {0.001, 100.0},
                  "[m] distance between neighbouring nodes of the graph, the scale at which the "
                  "mesh bends; time and memory are proportional to surface / spacing^2");
    visitor.field("time_window_keyframes", time_window_keyframes, {0, 1000000},
                  "surface seen further apart in time belongs to different visits; it moves "
                  "independently even if it is close in space");
    visitor.field("duplicate_faces", duplicate_faces, {0, 100'000'000},
                  "number of faces of a mesh up to which all copies stay; together they are closer "
                  "to the true surface than the best of them");
    visitor.field("seen_through_views", seen_through_views, {0, 1000},
                  "number of later views that must see through a surface, beyond those that show "
                  "it again, until it is removed; 0: all surface stays. Needs covariances of the "
                  "optimised poses (back-end newton)");
    visitor.field("period_s", period_s, {0.01, 86400.0},
                  "[s] shortest pause between two corrections; nine times the duration of the last "
                  "one if that is longer");
  }
};

}  // namespace km
