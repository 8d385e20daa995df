#include "modules/ros_dds/surface_pieces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "modules/ros_dds/mesh_cloud.hpp"

namespace km {
namespace {

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

}  // namespace

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
