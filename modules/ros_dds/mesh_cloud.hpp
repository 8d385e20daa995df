#pragma once

#include <cstddef>
#include <span>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// The vertices of a mesh as viewers of ROS take them: x, y, z and, where it has colours, rgb, a
/// float32 whose bits are 0x00RRGGBB. Of more than `most` (at least 1) vertices every n-th.
[[nodiscard]] RosPointCloud cloud_of(const LabelledMesh& mesh, std::size_t most, RosHeader header);

/// `faces` of a mesh, in the colours of their vertices or, without, grey.
[[nodiscard]] RosMarker surface_of(const LabelledMesh& mesh,
                                   std::span<const LabelledMesh::Face> faces, RosHeader header);

}  // namespace km
