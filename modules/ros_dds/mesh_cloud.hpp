#pragma once

#include <cstddef>
#include <span>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// The vertices of a mesh in the form of ROS viewers: x, y, z and, if the mesh has colours, rgb, a
/// float32 whose bits are 0x00RRGGBB. If there are more than `most` (at least 1) vertices, it
/// returns every n-th one.
[[nodiscard]] RosPointCloud2 cloud_of(const LabelledMesh& mesh, std::size_t most, RosHeader header);

/// `faces` of a mesh in the colours of their vertices, or in grey if the mesh has no colours.
[[nodiscard]] RosMarker surface_of(const LabelledMesh& mesh,
                                   std::span<const LabelledMesh::Face> faces, RosHeader header);

}  // namespace km
