#pragma once

#include "modules/core/ids.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"

namespace km {

/// A robot's mesh, corrected to agree with its optimised trajectory.
struct OptimizedMesh {
  RobotId robot = 0;
  RobotId anchor = 0;            ///< Robot whose odometry frame is `world`.
  LabelledMesh mesh;             ///< In `world`.
  MeshDeformationReport report;  ///< Of the last optimisation.
  bool deformed = true;  ///< False: no optimisation was due, the mesh before was moved as a whole.
  double seconds = 0.0;  ///< Time this took.
  std::size_t superseded_faces = 0;  ///< Of the map, left out: another visit saw them better.
};

}  // namespace km
