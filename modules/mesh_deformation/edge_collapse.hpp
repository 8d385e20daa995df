#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// Triangles between points that were each seen for some time.
struct TimedTriangles {
  std::vector<Eigen::Vector3d> points;  ///< [m]
  std::vector<SeenBy> seen_by;          ///< Of each point.
  std::vector<LabelledMesh::Face> faces;
};

/// Points that are left, and the one that each point was merged into.
struct CollapsedPoints {
  std::vector<std::uint32_t> kept;     ///< Index of a point; twice where surfaces cross there.
  std::vector<std::uint32_t> kept_of;  ///< For each point an index into `kept`.
};

/// Decimates by half-edge collapses in OpenMesh until `target` points are left that belong to
/// faces, or no collapse is possible. See extend() for their order; points seen further apart in
/// time than the window are not merged. Faces may meet in any way: where more than two share an
/// edge, the surface is cut open.
[[nodiscard]] CollapsedPoints collapse_edges(const TimedTriangles& triangles, std::size_t target,
                                             KeyframeIndex window_keyframes);

}  // namespace km
