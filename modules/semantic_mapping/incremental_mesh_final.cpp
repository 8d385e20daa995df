#include <algorithm>
#include <utility>

#include "modules/semantic_mapping/incremental_mesh.hpp"

namespace km {
namespace {

// Places of vertices by their ids.
class PlaceOfId {
 public:
  void add(std::uint64_t id, std::uint32_t place) { places_.emplace_back(id, place); }
  void sort() { std::sort(places_.begin(), places_.end()); }
  [[nodiscard]] std::uint32_t find(std::uint64_t id) const {
    const auto at = std::lower_bound(places_.begin(), places_.end(), std::pair(id, 0U));
    return at != places_.end() && at->first == id ? at->second : BlockMesh::kNone;
  }

 private:
  std::vector<std::pair<std::uint64_t, std::uint32_t>> places_;
};

}  // namespace

// By place; kNone for vertices that stay.
std::vector<std::uint32_t> IncrementalMesh::final_heirs(const SupersededSurface& superseded) const {
  PlaceOfId places;
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    if (vertices_[i].id != kRemoved && vertices_[i].owner == nullptr)
      places.add(vertices_[i].id, static_cast<std::uint32_t>(i));
  places.sort();
  std::vector<std::uint32_t> heirs(vertices_.size(), BlockMesh::kNone);
  for (const SupersededVertex& vertex : superseded.vertices) {
    const std::uint32_t place = places.find(vertex.id);
    if (place != BlockMesh::kNone) heirs[place] = places.find(vertex.heir);
  }
  return heirs;
}

SurfaceDrop IncrementalMesh::drop(const SupersededSurface& superseded) {
  const std::vector<std::uint32_t> heirs = final_heirs(superseded);
  SurfaceDrop dropped;
  std::erase_if(final_faces_, [&](const Face& face) {
    for (const std::uint32_t v : face)
      if (heirs[v] == BlockMesh::kNone) return false;
    release(face);
    ++dropped.faces;
    return true;
  });
  faces_ -= dropped.faces;
  for (const std::uint32_t place : maybe_unused_)
    if (vertices_[place].uses == 0) vertices_[heirs[place]].labels.add(vertices_[place].labels);
  dropped.vertices = remove_unused();
  return dropped;
}

MapMesh IncrementalMesh::snapshot(const BlockMap& map, bool labelled) const {
  std::vector<std::uint32_t> order;
  order.reserve(vertex_count());
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    if (vertices_[i].uses > 0) order.push_back(static_cast<std::uint32_t>(i));
  std::sort(order.begin(), order.end(),
            [&](auto a, auto b) { return vertices_[a].id < vertices_[b].id; });

  MapMesh map_mesh;
  map_mesh.voxel_m = voxel_m_;
  LabelledMesh& mesh = map_mesh.mesh;
  std::vector<std::uint32_t> index(vertices_.size());
  for (const std::uint32_t place : order) {
    const Vertex& vertex = vertices_[place];
    index[place] = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(vertex.position);
    if (labelled) mesh.labels.push_back(label_of(vertex.labels));
    map_mesh.seen_by.push_back({vertex.first, vertex.last});
    map_mesh.ids.push_back(vertex.id);
    map_mesh.certainty.push_back(vertex.certainty);
  }
  mesh.faces.reserve(faces_);
  const auto add = [&](const std::vector<Face>& faces) {
    for (const Face& face : faces)
      mesh.faces.push_back({index[face[0]], index[face[1]], index[face[2]]});
  };
  add(final_faces_);
  for (const auto& block : map.blocks())
    if (block->mesh != nullptr) add(block->mesh->faces);
  return map_mesh;
}

}  // namespace km
