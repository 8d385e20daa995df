#include "modules/semantic_mapping/incremental_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/mesh/surface_filter.hpp"

namespace km {
namespace {

// Vertices keep this distance [voxels] from the ends of their edges. At an end, vertices of several
// edges would coincide and faces would have no area.
constexpr float kMargin = 1e-3F;

// The blocks whose cells reach into `block`, with the offset to it in bits x + 2 y + 4 z.
template <typename Visit>
void visit_lower_neighbours(const VoxelBlock& block, BlockMap& map, const Visit& visit) {
  for (int offset = 1; offset < 8; ++offset) {
    const Eigen::Vector3i step(offset & 1, offset >> 1 & 1, offset >> 2 & 1);
    if (VoxelBlock* lower = map.find(block.position - step)) visit(*lower, offset);
  }
}

// True if the cell extends into the block at `offset`.
bool reaches(std::uint16_t cell, int offset) {
  const int last =
      ((cell & 7) == 7 ? 1 : 0) | ((cell >> 3 & 7) == 7 ? 2 : 0) | ((cell >> 6 & 7) == 7 ? 4 : 0);
  return (last & offset) == offset;
}

VoxelLabels labels_of(const VoxelBlock& block, std::size_t voxel) {
  return block.labels == nullptr ? VoxelLabels() : (*block.labels)[voxel];
}

VoxelColor color_of(const VoxelBlock& block, std::size_t voxel) {
  return block.colors == nullptr ? VoxelColor() : (*block.colors)[voxel];
}

// The colour at share `t` of the way from a to b. A voxel without colour does not count.
ColorImage::Pixel blended(const VoxelColor& a, const VoxelColor& b, float t) {
  if (a.quality == 0 || b.quality == 0) return a.quality == 0 ? b.color : a.color;
  ColorImage::Pixel color;
  for (std::size_t c = 0; c < color.size(); ++c)
    color[c] = static_cast<std::uint8_t>((1.0F - t) * static_cast<float>(a.color[c]) +
                                         t * static_cast<float>(b.color[c]) + 0.5F);
  return color;
}

// MapMesh::certainty of a weight: log4(weight) + 8.
std::uint8_t certainty_of(float weight) {
  const float steps = 0.5F * std::log2(std::max(weight, std::numeric_limits<float>::min())) + 8.0F;
  return static_cast<std::uint8_t>(std::clamp(steps, 0.0F, 255.0F));
}

// True if finer maps have the surface in a cell: at every edge that it crosses, they know the voxel
// nearest to the crossing.
bool is_refined(const BlockCells& cells, int x, int y, int z, std::span<const BlockMap> finer) {
  const unsigned negative = cells.negative_corners(x, y, z);
  for (int edge = 0; edge < MarchingCubes::kEdges; ++edge) {
    const int a = MarchingCubes::first_corner_of_edge(edge);
    const int b = a | 1 << MarchingCubes::axis_of_edge(edge);
    if ((negative >> a & 1U) == (negative >> b & 1U)) continue;
    const auto corner = [&](int c) {
      return Eigen::Vector3i(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1));
    };
    const auto distance = [&](int c) {
      return std::abs(cells.value(corner(c).x(), corner(c).y(), corner(c).z()));
    };
    const Eigen::Vector3i nearest = corner(distance(a) <= distance(b) ? a : b);
    if (!cells.is_finer(nearest.x(), nearest.y(), nearest.z(), finer)) return false;
  }
  return true;
}

void mark_changed(VoxelBlock& block, KeyframeIndex since) {
  block.changed_since = block.changed ? std::min(block.changed_since, since) : since;
  block.changed = true;
}

// Indices of vertices by their ids.
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

std::size_t IncrementalMesh::update(BlockMap& map, std::span<const BlockMap> finer) {
  std::vector<VoxelBlock*> blocks;
  for (const auto& block : map.blocks())
    if (block->changed) blocks.push_back(block.get());
  const std::size_t changed = blocks.size();
  for (std::size_t i = 0; i < changed; ++i)
    visit_lower_neighbours(*blocks[i], map, [&](VoxelBlock& lower, int) {
      if (lower.changed) return;
      mark_changed(lower, blocks[i]->changed_since);
      blocks.push_back(&lower);
    });
  return mesh_blocks(blocks, map, finer);
}

std::size_t IncrementalMesh::mesh_blocks(const std::vector<VoxelBlock*>& blocks, BlockMap& map,
                                         std::span<const BlockMap> finer) {
  ++update_;
  for (const Face& face : forgotten_faces_) release(face);
  faces_ -= forgotten_faces_.size();
  forgotten_faces_.clear();
  for (VoxelBlock* block : blocks) release_faces(*block);
  for (VoxelBlock* block : blocks) mesh_block(*block, map, finer);
  for (VoxelBlock* block : blocks) {
    block->changed = false;
    block->near_rows.fill(0);
  }
  remove_unused();
  return blocks.size();
}

void IncrementalMesh::release(const Face& face) {
  for (const std::uint32_t v : face)
    if (--vertices_[v].uses == 0) maybe_unused_.push_back(v);
}

void IncrementalMesh::release_faces(VoxelBlock& block) {
  if (block.mesh == nullptr) return;
  for (const Face& face : block.mesh->faces) release(face);
  faces_ -= block.mesh->faces.size();
  block.mesh->faces.clear();
  block.mesh->cell_of_face.clear();
}

void IncrementalMesh::mesh_block(VoxelBlock& block, BlockMap& map,
                                 std::span<const BlockMap> finer) {
  const BlockCells cells(block, map);
  if (!cells.any()) return;
  std::array<std::uint32_t, MarchingCubes::kEdges> vertices;
  for (int z = 0; z < kBlockSide; ++z)
    for (int y = 0; y < kBlockSide; ++y) {
      const unsigned crossed = cells.crossed(y, z);
      for (int x = 0; x < kBlockSide; ++x) {
        if ((crossed >> x & 1U) == 0) continue;
        if (!finer.empty() && is_refined(cells, x, y, z, finer)) continue;
        vertices.fill(BlockMesh::kNone);
        for (const auto& triangle : table_.triangles(cells.negative_corners(x, y, z))) {
          Face face;
          for (std::size_t i = 0; i < 3; ++i) {
            std::uint32_t& vertex = vertices[triangle[i]];
            const int corner = MarchingCubes::first_corner_of_edge(triangle[i]);
            if (vertex == BlockMesh::kNone)
              vertex =
                  vertex_on(cells, {x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2 & 1)},
                            MarchingCubes::axis_of_edge(triangle[i]), block);
            face[i] = vertex;
            ++vertices_[vertex].uses;
            vertices_[vertex].level = static_cast<std::uint8_t>(finer.size());
          }
          if (block.mesh == nullptr) block.mesh = std::make_unique<BlockMesh>();
          block.mesh->faces.push_back(face);
          block.mesh->cell_of_face.push_back(static_cast<std::uint16_t>(voxel_index(x, y, z)));
          ++faces_;
        }
      }
    }
}

std::uint32_t IncrementalMesh::vertex_on(const BlockCells& cells, const Eigen::Vector3i& voxel,
                                         int axis, const VoxelBlock& meshed) {
  VoxelBlock& owner = cells.block_of(voxel.x(), voxel.y(), voxel.z());
  if (owner.mesh == nullptr) owner.mesh = std::make_unique<BlockMesh>();
  const std::size_t edge =
      3 * voxel_index(voxel.x() & 7, voxel.y() & 7, voxel.z() & 7) + static_cast<std::size_t>(axis);
  std::uint32_t& place = owner.mesh->vertex_of_edge[edge];
  if (place == BlockMesh::kNone) {
    place = new_vertex(meshed.changed_since);
    vertices_[place].owner = owner.mesh.get();
    vertices_[place].edge = static_cast<std::uint16_t>(edge);
  }
  Vertex& vertex = vertices_[place];
  if (vertex.computed != update_) {
    vertex.computed = update_;
    compute(vertex, cells, voxel, axis);
  }
  return place;
}

std::uint32_t IncrementalMesh::new_vertex(KeyframeIndex keyframe) {
  if (free_.empty()) {
    free_.push_back(static_cast<std::uint32_t>(vertices_.size()));
    vertices_.emplace_back();
  }
  const std::uint32_t place = free_.back();
  free_.pop_back();
  Vertex& vertex = vertices_[place];
  vertex = {};
  vertex.id = next_id_++;
  vertex.first = vertex.last = keyframe;
  return place;
}

void IncrementalMesh::compute(Vertex& vertex, const BlockCells& cells, const Eigen::Vector3i& voxel,
                              int axis) const {
  const Eigen::Vector3i far = voxel + Eigen::Vector3i::Unit(axis);
  const float a = cells.value(voxel.x(), voxel.y(), voxel.z());
  const float b = cells.value(far.x(), far.y(), far.z());
  const float t = std::clamp(a / (a - b), kMargin, 1.0F - kMargin);
  const VoxelBlock& near_block = cells.block_of(voxel.x(), voxel.y(), voxel.z());
  const VoxelBlock& far_block = cells.block_of(far.x(), far.y(), far.z());
  const auto index_of = [](const Eigen::Vector3i& at) {
    return voxel_index(at.x() & 7, at.y() & 7, at.z() & 7);
  };
  const std::size_t near_voxel = index_of(voxel), far_voxel = index_of(far);

  const Eigen::Vector3i local(voxel.x() & 7, voxel.y() & 7, voxel.z() & 7);
  Eigen::Vector3d grid = (kBlockSide * near_block.position + local).cast<double>();
  grid[axis] += static_cast<double>(t);
  vertex.position = (cells.voxel_m() * grid).cast<float>();

  // The labels of the voxel behind the surface come first. The ray to this voxel went through the
  // surface here. The ray to the voxel in front continues and may meet another surface.
  const VoxelLabels near_labels = labels_of(near_block, near_voxel);
  const VoxelLabels far_labels = labels_of(far_block, far_voxel);
  vertex.labels = a < 0.0F ? near_labels : far_labels;
  if (vertex.labels.best() == 0) vertex.labels = a < 0.0F ? far_labels : near_labels;

  vertex.color = blended(color_of(near_block, near_voxel), color_of(far_block, far_voxel), t);

  vertex.certainty =
      certainty_of(std::min(near_block.weight[near_voxel], far_block.weight[far_voxel]));

  const auto seen = [](const VoxelBlock& block, std::size_t v) {
    return (block.near_rows[v / kBlockSide] >> v % kBlockSide & 1U) != 0;
  };
  if (seen(near_block, near_voxel)) vertex.last = std::max(vertex.last, near_block.last_seen);
  if (seen(far_block, far_voxel)) vertex.last = std::max(vertex.last, far_block.last_seen);
}

std::size_t IncrementalMesh::remove_unused() {
  std::size_t removed = 0;
  for (const std::uint32_t place : maybe_unused_) {
    Vertex& vertex = vertices_[place];
    if (vertex.uses > 0 || vertex.id == kRemoved) continue;
    if (vertex.owner != nullptr) vertex.owner->vertex_of_edge[vertex.edge] = BlockMesh::kNone;
    vertex.owner = nullptr;
    vertex.id = kRemoved;
    free_.push_back(place);
    ++removed;
  }
  maybe_unused_.clear();
  return removed;
}

void IncrementalMesh::disown(VoxelBlock& block) {
  if (block.mesh == nullptr) return;
  for (const std::uint32_t place : block.mesh->vertex_of_edge)
    if (place != BlockMesh::kNone) vertices_[place].owner = nullptr;
}

void IncrementalMesh::forget(VoxelBlock& block, BlockMap& map, KeyframeIndex keyframe) {
  visit_lower_neighbours(block, map,
                         [&](VoxelBlock& lower, int) { mark_changed(lower, keyframe); });
  if (block.mesh == nullptr) return;
  forgotten_faces_.insert(forgotten_faces_.end(), block.mesh->faces.begin(),
                          block.mesh->faces.end());
  disown(block);
}

std::size_t IncrementalMesh::finalise(const std::vector<VoxelBlock*>& blocks, BlockMap& map,
                                      std::span<const BlockMap> finer) {
  // The lower neighbours of `blocks` have cells that extend into `blocks`. They are meshed as well,
  // because their cells need the voxels of `blocks`, which are discarded afterwards.
  std::vector<VoxelBlock*> last_time;
  const auto add = [&](VoxelBlock& block) {
    if (!block.changed) return;
    block.changed = false;  // once only
    last_time.push_back(&block);
  };
  for (VoxelBlock* block : blocks) {
    add(*block);
    visit_lower_neighbours(*block, map, [&](VoxelBlock& lower, int) { add(lower); });
  }
  for (VoxelBlock* block : last_time) block->changed = true;
  for (VoxelBlock* block : last_time)  // their lower neighbours are meshed by the next update
    visit_lower_neighbours(*block, map, [&](VoxelBlock& lower, int) {
      if (!lower.changed) mark_changed(lower, block->changed_since);
    });
  const std::size_t meshed = mesh_blocks(last_time, map, finer);
  for (VoxelBlock* block : blocks) finalise(*block, map);
  return meshed;
}

void IncrementalMesh::finalise(VoxelBlock& block, BlockMap& map) {
  if (block.mesh != nullptr) {
    auto& faces = block.mesh->faces;
    final_faces_.insert(final_faces_.end(), faces.begin(), faces.end());
    faces.clear();
    block.mesh->cell_of_face.clear();
  }
  visit_lower_neighbours(block, map, [&](VoxelBlock& lower, int offset) {
    if (lower.mesh == nullptr) return;
    auto& faces = lower.mesh->faces;
    auto& cells = lower.mesh->cell_of_face;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < faces.size(); ++i) {
      if (reaches(cells[i], offset)) {
        final_faces_.push_back(faces[i]);
        continue;
      }
      faces[kept] = faces[i];
      cells[kept++] = cells[i];
    }
    faces.resize(kept);
    cells.resize(kept);
  });
  disown(block);
}

// Returns, by index of the vertex, the index of its replacement; kNone for vertices that are kept.
std::vector<std::uint32_t> IncrementalMesh::final_replacements(
    const SupersededSurface& superseded) const {
  PlaceOfId places;
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    if (vertices_[i].id != kRemoved && vertices_[i].owner == nullptr)
      places.add(vertices_[i].id, static_cast<std::uint32_t>(i));
  places.sort();
  std::vector<std::uint32_t> replacements(vertices_.size(), BlockMesh::kNone);
  for (const SupersededVertex& vertex : superseded.vertices) {
    const std::uint32_t place = places.find(vertex.id);
    if (place != BlockMesh::kNone) replacements[place] = places.find(vertex.replacement);
  }
  return replacements;
}

SurfaceDrop IncrementalMesh::drop(const SupersededSurface& superseded) {
  const std::vector<std::uint32_t> replacements = final_replacements(superseded);
  SurfaceDrop dropped;
  std::erase_if(final_faces_, [&](const Face& face) {
    for (const std::uint32_t v : face)
      if (replacements[v] == BlockMesh::kNone) return false;
    release(face);
    ++dropped.faces;
    return true;
  });
  faces_ -= dropped.faces;
  for (const std::uint32_t place : maybe_unused_)
    if (vertices_[place].uses == 0 && replacements[place] != place)
      vertices_[replacements[place]].labels.add(vertices_[place].labels);
  dropped.vertices = remove_unused();
  return dropped;
}

MapMesh IncrementalMesh::snapshot(std::span<const BlockMap> maps, bool labelled, bool coloured) {
  std::vector<std::uint32_t> order;
  order.reserve(vertex_count());
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    if (vertices_[i].uses > 0) order.push_back(static_cast<std::uint32_t>(i));
  std::sort(order.begin(), order.end(),
            [&](auto a, auto b) { return vertices_[a].id < vertices_[b].id; });

  MapMesh map_mesh;
  map_mesh.voxel_m = maps.front().voxel_m();
  LabelledMesh& mesh = map_mesh.mesh;
  std::vector<std::uint32_t> index(vertices_.size()), changed;
  std::vector<Eigen::Vector3f> filtered;
  const auto least_move_m = static_cast<float>(0.05 * map_mesh.voxel_m);
  for (const std::uint32_t place : order) {
    const Vertex& vertex = vertices_[place];
    index[place] = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(vertex.position);
    filtered.push_back(vertex.filtered);
    if (!((vertex.position - vertex.filtered_at).norm() <= least_move_m))
      changed.push_back(index[place]);
    if (labelled) mesh.labels.push_back(vertex.labels.best());
    if (coloured) mesh.colors.push_back(vertex.color);
    map_mesh.seen_by.push_back({vertex.first, vertex.last});
    map_mesh.ids.push_back(vertex.id);
    map_mesh.certainty.push_back(vertex.certainty);
    map_mesh.levels.push_back(vertex.level);
  }
  mesh.faces.reserve(faces_);
  const auto add = [&](const std::vector<Face>& faces) {
    for (const Face& face : faces)
      mesh.faces.push_back({index[face[0]], index[face[1]], index[face[2]]});
  };
  add(final_faces_);
  for (const BlockMap& map : maps)
    for (const auto& block : map.blocks())
      if (block->mesh != nullptr) add(block->mesh->faces);
  filter_surface(mesh.vertices, mesh.faces, changed, filtered);
  for (const std::uint32_t i : changed) vertices_[order[i]].filtered_at = mesh.vertices[i];
  for (std::size_t i = 0; i < order.size(); ++i) vertices_[order[i]].filtered = filtered[i];
  mesh.vertices = std::move(filtered);
  return map_mesh;
}

}  // namespace km
