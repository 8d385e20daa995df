#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of LocalMeshOptimizer. Field names are the YAML keys below `mesh_deformation:`.
struct MeshDeformationConfig {
  static constexpr const char* kSection = "mesh_deformation";

  /// Distance between neighbouring nodes of the deformation graph [m]. The mesh bends at this
  /// scale; time and memory grow with surface / spacing^2.
  double node_spacing_m = 0.5;

  /// Nodes that move a vertex: k of the paper.
  int interpolation_nodes = 4;

  /// Surface seen at times that lie further apart than this many keyframes belongs to different
  /// visits: it may be close in space but moves on its own.
  int time_window_keyframes = 15;

  /// Of surface that several visits mapped, the copies no further from the best one than so many
  /// voxels of the map, once all are corrected, are dropped from the mesh, and from the map for
  /// good: in a place that is seen again and again, memory stays bounded. 0: all copies stay.
  double duplicate_voxels = 1.0;

  /// Faces of a mesh up to which all copies stay: together they lie nearer to the true surface than
  /// the best of them, so none is dropped for want of memory before it is wanted.
  int duplicate_faces = 1'200'000;

  /// Keyframes that hold a node, of those that saw it.
  int keyframes_per_node = 4;

  /// Standard deviations of the three terms: of the keyframes about their optimised poses, of the
  /// distance vector between neighbouring nodes, of a node as seen from a keyframe.
  double anchor_rotation_rad = 0.001;
  double anchor_translation_m = 0.005;
  double mesh_edge_m = 0.05;
  double keyframe_tie_m = 0.02;

  /// Bound on the iterations of one solution.
  int max_iterations = 30;

  /// A solution ends when a step changes the energy by less than this share. At 1e-7, vertices are
  /// within a millimetre of the minimum.
  double energy_tolerance = 1e-7;

  /// The mesh is bent anew when a keyframe moved this far against the others, and moved as a whole
  /// when all moved that far alike [m], [rad].
  double min_move_m = 0.01;
  double min_rotation_rad = 0.005;

  /// Rest between two corrections [s]: bounds the time that this takes from the robot.
  double period_s = 2.0;

  void visit_fields(auto& visitor) {
    visitor.field("node_spacing_m", node_spacing_m, {0.001, 100.0}, "[m] between graph nodes");
    visitor.field("interpolation_nodes", interpolation_nodes, {1, 8}, "that move a vertex");
    visitor.field("time_window_keyframes", time_window_keyframes, {0, 1000000},
                  "further apart: another visit");
    visitor.field("duplicate_voxels", duplicate_voxels, {0.0, 8.0},
                  "[voxels] to a better copy: dropped; 0: never");
    visitor.field("duplicate_faces", duplicate_faces, {0, 100'000'000},
                  "of a mesh, up to which all copies stay");
    visitor.field("keyframes_per_node", keyframes_per_node, {1, 64}, "that hold a node");
    visitor.field("anchor_rotation_rad", anchor_rotation_rad, {1e-9, 10.0}, "[rad] std. dev.");
    visitor.field("anchor_translation_m", anchor_translation_m, {1e-9, 100.0}, "[m] std. dev.");
    visitor.field("mesh_edge_m", mesh_edge_m, {1e-9, 100.0}, "[m] std. dev. between nodes");
    visitor.field("keyframe_tie_m", keyframe_tie_m, {1e-9, 100.0}, "[m] std. dev. from a keyframe");
    visitor.field("max_iterations", max_iterations, {1, 1000}, "of one solution");
    visitor.field("energy_tolerance", energy_tolerance, {1e-15, 0.1}, "smaller step: the last");
    visitor.field("min_move_m", min_move_m, {1e-6, 100.0}, "[m] of a keyframe, to act");
    visitor.field("min_rotation_rad", min_rotation_rad, {1e-6, 3.2}, "[rad] likewise");
    visitor.field("period_s", period_s, {0.01, 86400.0}, "[s] between two corrections");
  }
};

}  // namespace km
