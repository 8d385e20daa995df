#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/seen_by.hpp"

namespace km {

/// A point of a surface with its normal, label and views.
struct SurfaceSample {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< Unit vector towards free space.
  LabelId label = 0;                                  ///< 0: unknown.
  SeenBy seen_by = {0, 0};                            ///< First and last keyframe of its visit.
};

/// Samples of a mesh, one for each cell of a grid and each of the six main directions of normals.
/// A sample is the mean of the faces of its cell, weighted by their area. The two sides of a thin
/// wall in one cell are therefore two samples. Cells with little area are left out. So are cells
/// whose normals differ too much for a plane. Views are not set. Ordered by cell. Throws
/// std::invalid_argument unless `spacing_m`, the side of a cell, is positive. Preconditions:
/// vertices are finite, and corners of faces exist.
[[nodiscard]] std::vector<SurfaceSample> sample_plane_patches(const LabelledMesh& mesh,
                                                              double spacing_m);

/// Moves samples to another frame: p_a = T_a_b * p_b.
void transform(std::vector<SurfaceSample>& samples, const SE3& T_a_b);

}  // namespace km
