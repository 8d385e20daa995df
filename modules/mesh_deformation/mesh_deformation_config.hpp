#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of LocalMeshOptimizer, MeshCorrector and MeshDeformationNode.
struct MeshDeformationConfig {
  static constexpr const char* kSection = "mesh_deformation";

  double node_spacing_m = 0.5;
  int interpolation_nodes = 4;
  int time_window_keyframes = 15;
  double duplicate_voxels = 1.0;
  int duplicate_faces = 100'000;
  int duplicate_copies = 2;
  double duplicate_share = 0.5;
  int seen_through_views = 3;
  int keyframes_per_node = 4;
  double anchor_rotation_rad = 0.001;
  double anchor_translation_m = 0.005;
  double mesh_edge_m = 0.05;
  double keyframe_edge_m = 0.02;
  int max_iterations = 30;
  double energy_tolerance = 1e-5;
  double min_move_m = 0.01;
  double min_rotation_rad = 0.005;
  double period_s = 2.0;

  void visit_fields(auto& visitor) {
    visitor.field("node_spacing_m", node_spacing_m, {0.001, 100.0},
                  "[m] distance between neighbouring nodes of the graph, the scale at which the "
                  "mesh bends; time and memory are proportional to surface / spacing^2");
    visitor.field("interpolation_nodes", interpolation_nodes, {1, 8},
                  "number of nodes that move a vertex: the paper's k");
    visitor.field("time_window_keyframes", time_window_keyframes, {0, 1000000},
                  "surface seen further apart in time belongs to different visits; it moves "
                  "independently even if it is close in space");
    visitor.field("duplicate_voxels", duplicate_voxels, {0.0, 8.0},
                  "[voxels] largest distance of a copy from the best ones, after correction, at "
                  "which it is dropped permanently from mesh and map, so that memory is bounded; "
                  "0: all copies stay");
    visitor.field("duplicate_faces", duplicate_faces, {0, 100'000'000},
                  "number of faces of a mesh up to which all copies stay; together they are closer "
                  "to the true surface than the best of them");
    visitor.field("duplicate_copies", duplicate_copies, {1, 1000},
                  "number of copies of a surface from several visits that stay; with one, walls "
                  "have holes");
    visitor.field(
        "duplicate_share", duplicate_share, {0.0, 1000.0},
        "number of faces of further copies, as a share of all other faces, above which they are "
        "dropped from a larger mesh; memory is proportional to 1 + duplicate_share");
    visitor.field("seen_through_views", seen_through_views, {0, 1000},
                  "number of later views that must see through a surface, beyond those that show "
                  "it again, until it is removed; 0: all surface stays. Needs covariances of the "
                  "optimised poses (back-end newton)");
    visitor.field("keyframes_per_node", keyframes_per_node, {1, 64},
                  "largest number of keyframes that hold a node");
    visitor.field("anchor_rotation_rad", anchor_rotation_rad, {1e-9, 10.0},
                  "[rad] standard deviation of keyframes about their optimised poses");
    visitor.field("anchor_translation_m", anchor_translation_m, {1e-9, 100.0},
                  "[m] standard deviation of keyframes about their optimised poses");
    visitor.field("mesh_edge_m", mesh_edge_m, {1e-9, 100.0},
                  "[m] standard deviation of the distance vector between neighbouring nodes");
    visitor.field("keyframe_edge_m", keyframe_edge_m, {1e-9, 100.0},
                  "[m] standard deviation of a node relative to a keyframe that saw it");
    visitor.field("max_iterations", max_iterations, {1, 1000},
                  "largest number of iterations of one solution");
    visitor.field("energy_tolerance", energy_tolerance, {1e-15, 0.1},
                  "share of the energy; the solver stops after a step that changes less. At 1e-5 "
                  "vertices are within a millimetre of the minimum");
    visitor.field("min_move_m", min_move_m, {1e-6, 100.0},
                  "[m] motion of a keyframe relative to the others after which the mesh is "
                  "deformed again; after such a motion common to all, it is moved as a whole");
    visitor.field("min_rotation_rad", min_rotation_rad, {1e-6, 3.2},
                  "[rad] rotation of a keyframe relative to the others after which the mesh is "
                  "deformed again; after such a rotation common to all, it is moved as a whole");
    visitor.field("period_s", period_s, {0.01, 86400.0},
                  "[s] pause between two corrections, which bounds their share of processor time");
  }
};

}  // namespace km
