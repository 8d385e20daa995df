#include "modules/ros_dds/mesh_cloud.hpp"

#include <cstdint>
#include <utility>

#include "modules/core/bytes.hpp"

namespace km {

RosPointCloud2 cloud_of(const LabelledMesh& mesh, std::size_t most, RosHeader header) {
  const bool has_colors = mesh.colors.size() == mesh.vertices.size();
  const std::size_t step = (mesh.vertices.size() + most - 1) / most;
  RosPointCloud2 cloud;
  cloud.header = std::move(header);
  cloud.height = 1;
  for (const char* name : {"x", "y", "z", "rgb"}) {
    if (!has_colors && cloud.fields.size() == 3) break;
    cloud.fields.push_back({name, cloud.point_step, kRosFloat32, 1});
    cloud.point_step += sizeof(float);
  }
  ByteWriter data;
  for (std::size_t k = 0; k < mesh.vertices.size(); k += step) {
    for (const float coordinate : mesh.vertices[k]) data.f32(coordinate);
    if (has_colors) {
      const auto& [red, green, blue] = mesh.colors[k];
      data.u32(std::uint32_t{red} << 16U | std::uint32_t{green} << 8U | blue);
    }
    ++cloud.width;
  }
  cloud.data = data.release();
  cloud.row_step = cloud.width * cloud.point_step;
  cloud.is_dense = true;
  return cloud;
}

RosMarker surface_of(const LabelledMesh& mesh, std::span<const LabelledMesh::Face> faces,
                     RosHeader header) {
  constexpr float kFull = 255.0F, kGrey = 0.6F;
  const bool has_colors = mesh.colors.size() == mesh.vertices.size();
  RosMarker marker;
  marker.header = std::move(header);
  marker.ns = "mesh";
  marker.type = RosMarkerType::kTriangleList;
  marker.scale.setOnes();
  marker.color = {kGrey, kGrey, kGrey, 1.0F};
  marker.points.reserve(3 * faces.size());
  if (has_colors) marker.colors.reserve(3 * faces.size());
  for (const LabelledMesh::Face& face : faces)
    for (const std::uint32_t vertex : face) {
      marker.points.emplace_back(mesh.vertices[vertex].cast<double>());
      if (!has_colors) continue;
      const auto& [red, green, blue] = mesh.colors[vertex];
      marker.colors.emplace_back(red / kFull, green / kFull, blue / kFull, 1.0F);
    }
  return marker;
}

}  // namespace km
