#pragma once

#include "modules/core/stamp.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// The distance field at one height: a point per observed voxel, in the odometry frame. Colours go
/// from red (0 m) over yellow to green (the largest distance); points behind a surface are blue.
struct DistanceSlice {
  Stamp stamp = 0;
  LabelledMesh points;  ///< Vertices and colours only.
};

}  // namespace km
