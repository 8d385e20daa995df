#include "modules/ros_dds/drawings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "modules/core/io/bytes.hpp"
#include "modules/objects/object_file.hpp"

namespace km {
namespace {

constexpr float kOpacity = 0.4F;
constexpr double kText_m = 0.3;
constexpr double kThinnest_m = 0.01;  // viewers do not draw cubes without volume

Eigen::Vector4f color_of(const LabelPalette& palette, LabelId label) {
  const LabelClass* const known = palette.find(label);
  if (known == nullptr) return {0.5F, 0.5F, 0.5F, kOpacity};
  const auto& [red, green, blue] = known->color;
  return {static_cast<float>(red) / 255.0F, static_cast<float>(green) / 255.0F,
          static_cast<float>(blue) / 255.0F, kOpacity};
}

constexpr double kLine_m = 0.02;

struct Kind {
  const char* name;
  std::array<float, 3> color;
};
// By ClosureStatus.
constexpr std::array<Kind, 4> kKinds = {{{"candidates", {0.6F, 0.6F, 0.6F}},
                                         {"verified", {1.0F, 0.8F, 0.1F}},
                                         {"rejected", {0.9F, 0.2F, 0.15F}},
                                         {"kept", {0.15F, 0.75F, 0.3F}}}};

std::optional<SE3> pose_of(const KeyframeId& keyframe, const Trajectory& trajectory) {
  if (keyframe.robot != trajectory.robot || keyframe.index >= trajectory.T_world_kf.size())
    return std::nullopt;
  return trajectory.T_world_kf[keyframe.index];
}

// Maps each vertex to the first vertex of its cell.
std::vector<std::uint32_t> first_of_cells(const LabelledMesh& mesh, float cell_m) {
  std::map<std::array<std::int64_t, 3>, std::uint32_t> first;
  std::vector<std::uint32_t> result;
  result.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    std::array<std::int64_t, 3> cell{};
    for (int axis = 0; axis < 3; ++axis)
      cell[static_cast<std::size_t>(axis)] =
          static_cast<std::int64_t>(std::floor(vertex[axis] / cell_m));
    result.push_back(first.emplace(cell, static_cast<std::uint32_t>(result.size())).first->second);
  }
  return result;
}

float mean_edge_m(const LabelledMesh& mesh) {
  double sum = 0.0;
  for (const LabelledMesh::Face& face : mesh.faces)
    sum += static_cast<double>((mesh.vertices[face[0]] - mesh.vertices[face[1]]).norm());
  return static_cast<float>(sum / static_cast<double>(mesh.faces.size()));
}

// A white marker of 1 m.
RosMarker marker_of(const RosHeader& header, const char* ns, std::int32_t type) {
  RosMarker marker;
  marker.header = header;
  marker.ns = ns;
  marker.type = type;
  marker.scale.setOnes();
  marker.color.setOnes();
  return marker;
}

}  // namespace

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
                     const RosHeader& header) {
  constexpr float kFull = 255.0F, kGrey = 0.6F;
  const bool has_colors = mesh.colors.size() == mesh.vertices.size();
  RosMarker marker = marker_of(header, "mesh", RosMarkerType::kTriangleList);
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

RosMarkerArray object_markers(std::span<const MapObject> objects, const LabelPalette& palette,
                              const RosHeader& header) {
  RosMarkerArray message;
  message.markers.push_back(marker_of(header, "", 0));
  message.markers.back().action = RosMarkerAction::kDeleteAll;
  for (const MapObject& object : objects) {
    const SE3 T_map_box = object.box.pose();
    RosMarker marker = marker_of(header, "boxes", RosMarkerType::kCube);
    marker.id = static_cast<std::int32_t>(message.markers.size() / 2);
    marker.pose = {T_map_box.translation(), Eigen::Quaterniond(T_map_box.linear())};
    marker.scale = object.box.size_m.cwiseMax(kThinnest_m);
    marker.color = color_of(palette, object.label);
    message.markers.push_back(marker);
    marker.ns = "names";
    marker.type = RosMarkerType::kText;
    marker.pose.position.z() += 0.5 * object.box.size_m.z() + kText_m;
    marker.scale = {0.0, 0.0, kText_m};
    marker.color.setOnes();
    marker.text = class_name(palette, object.label);
    message.markers.push_back(std::move(marker));
  }
  return message;
}

RosMarkerArray closure_lines(std::span<const PublishedClosure> closures,
                             const Trajectory& trajectory, const RosHeader& header) {
  RosMarkerArray message;
  for (const Kind& kind : kKinds) {
    RosMarker& marker =
        message.markers.emplace_back(marker_of(header, kind.name, RosMarkerType::kLineList));
    marker.scale = {kLine_m, 0.0, 0.0};
    marker.color = {kind.color[0], kind.color[1], kind.color[2], 1.0F};
  }
  for (const PublishedClosure& closure : closures) {
    auto from = pose_of(closure.id.from, trajectory);
    auto to = pose_of(closure.id.to, trajectory);
    if (from && !to && closure.T_from_to) to = *from * *closure.T_from_to;
    if (to && !from && closure.T_from_to) from = *to * closure.T_from_to->inverse();
    if (!from || !to) continue;
    auto& points = message.markers[static_cast<std::size_t>(closure.status)].points;
    points.push_back(from->translation());
    points.push_back(to->translation());
  }
  return message;
}

LabelledMesh coarsened(const LabelledMesh& mesh, std::size_t most) {
  constexpr float kLeast_m = 1e-3F, kCoarser = 1.4F;
  if (mesh.faces.size() <= most) return mesh;
  LabelledMesh result = mesh;
  for (float cell_m = std::max(mean_edge_m(mesh), kLeast_m); result.faces.size() > most;
       cell_m *= kCoarser) {
    const std::vector<std::uint32_t> first = first_of_cells(mesh, cell_m);
    result.faces.clear();
    for (const LabelledMesh::Face& face : mesh.faces) {
      const LabelledMesh::Face moved = {first[face[0]], first[face[1]], first[face[2]]};
      if (moved[0] != moved[1] && moved[1] != moved[2] && moved[2] != moved[0])
        result.faces.push_back(moved);
    }
  }
  return result;
}

std::optional<RosMarker> SurfacePieces::next(const RosHeader& header) {
  const auto pieces = [this] { return published_ ? count(published_->faces.size()) : 0; };
  if (next_ >= std::max(pieces(), former_pieces_) && waiting_) {
    former_pieces_ = pieces();
    published_ = std::exchange(waiting_, nullptr);
    next_ = 0;
  }
  if (next_ >= std::max(pieces(), former_pieces_)) return std::nullopt;
  const std::size_t begin = std::min(next_ * kFaces, published_->faces.size());
  const std::size_t size = std::min(kFaces, published_->faces.size() - begin);
  RosMarker marker =
      surface_of(*published_, std::span(published_->faces).subspan(begin, size), header);
  marker.id = static_cast<std::int32_t>(next_++);
  if (size == 0) marker.action = RosMarkerAction::kDelete;
  return marker;
}

}  // namespace km
