#include "modules/team_map/team_map.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace km {
namespace {

using Box = std::array<std::int32_t, 3>;

std::array<Eigen::Vector3f, 3> corners_of(const MeshChunk& chunk, const MeshChunk::Triple& face) {
  std::array<Eigen::Vector3f, 3> corners;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      corners[i][static_cast<Eigen::Index>(axis)] = static_cast<float>(
          static_cast<double>(chunk.step_m) *
          static_cast<double>(std::int64_t{chunk.origin[axis]} + chunk.offsets[face[i]][axis]));
  return corners;
}

// The label of two corners, or else of the first.
LabelId label_of(const MeshChunk& chunk, const MeshChunk::Triple& face) {
  if (chunk.labels.empty()) return 0;
  const LabelId a = chunk.labels[face[0]], b = chunk.labels[face[1]], c = chunk.labels[face[2]];
  return b == c ? b : a;
}

Eigen::AlignedBox3f bounds_of(const std::array<Eigen::Vector3f, 3>& corners, float margin_m) {
  Eigen::AlignedBox3f bounds(corners[0]);
  bounds.extend(corners[1]).extend(corners[2]);
  const Eigen::Vector3f margin = Eigen::Vector3f::Constant(margin_m);
  return {bounds.min() - margin, bounds.max() + margin};
}

// True for a face that no mapper makes; it could be near any number of boxes.
bool is_oversized(const Eigen::AlignedBox3f& bounds, const SurfaceFusion& fusion) {
  return bounds.sizes().maxCoeff() > fusion.side_m() + 2.0F * fusion.reach_m();
}

// The boxes near the faces of the chunk.
std::set<Box> boxes_of(const MeshChunk& chunk, const SurfaceFusion& fusion) {
  std::set<Box> boxes;
  std::pair<Box, Box> last;  // neighbours in the list are usually neighbours in space
  for (const MeshChunk::Triple& face : chunk.faces) {
    const Eigen::AlignedBox3f bounds = bounds_of(corners_of(chunk, face), fusion.reach_m());
    if (is_oversized(bounds, fusion)) continue;
    const std::pair<Box, Box> range{fusion.box_of(bounds.min()), fusion.box_of(bounds.max())};
    if (!boxes.empty() && range == last) continue;
    last = range;
    const auto& [low, high] = range;
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z) boxes.insert({x, y, z});
  }
  return boxes;
}

}  // namespace

ChunkVerdict TeamMap::add(MeshChunk chunk) {
  std::vector<MeshChunk> replaced;
  if (const auto* own = chunks_.chunks_of(chunk.key.robot); own != nullptr && !own->empty()) {
    if (own->begin()->second.boot != chunk.boot) {  // the robot has restarted
      for (const auto& [key, former] : *own) replaced.push_back(former);
    } else if (const auto former = own->find(chunk.key); former != own->end()) {
      replaced.push_back(former->second);
    }
  }
  const ChunkVerdict verdict = chunks_.add(chunk);
  if (verdict != ChunkVerdict::kTaken) return verdict;
  for (const MeshChunk& former : replaced) note(former, Presence::kRemoved);
  if (!chunk.empty()) note(chunk, Presence::kAdded);
  choose_anchor();
  return verdict;
}

void TeamMap::note(const MeshChunk& chunk, Presence presence) {
  const bool added = presence == Presence::kAdded;
  chunks_with_anchor_[chunk.anchor] += added ? 1 : -1;
  for (const Box& box : boxes_of(chunk, fusion_)) {
    const auto near = chunks_near_.find(box);
    if (near == chunks_near_.end() && (!added || chunks_near_.size() >= kMaxBoxes)) continue;
    changed_.insert(box);
    if (added) {
      chunks_near_[box].insert(chunk.key);
    } else if (near->second.erase(chunk.key); near->second.empty()) {
      chunks_near_.erase(near);
    }
  }
}

void TeamMap::choose_anchor() {
  const auto most = std::ranges::max_element(
      chunks_with_anchor_, [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == chunks_with_anchor_.end() || most->first == anchor_) return;
  anchor_ = most->first;
  for (const auto& [box, keys] : chunks_near_) changed_.insert(box);
}

std::vector<RobotSurface> TeamMap::surfaces_near(const Box& box) const {
  std::vector<RobotSurface> surfaces;
  const auto keys = chunks_near_.find(box);
  if (keys == chunks_near_.end()) return surfaces;
  const Eigen::Vector3f low =
      fusion_.side_m() * Eigen::Vector3i(box[0], box[1], box[2]).cast<float>();
  const Eigen::AlignedBox3f space(low, low + Eigen::Vector3f::Constant(fusion_.side_m()));
  for (const MeshChunkKey& key : keys->second) {
    const MeshChunk& chunk = chunks_.chunks_of(key.robot)->at(key);
    if (chunk.anchor != anchor_) continue;
    if (surfaces.empty() || surfaces.back().robot != key.robot)
      surfaces.push_back({.robot = key.robot, .triangles = {}});
    for (const MeshChunk::Triple& face : chunk.faces) {
      const auto corners = corners_of(chunk, face);
      const Eigen::AlignedBox3f bounds = bounds_of(corners, fusion_.reach_m());
      if (space.intersects(bounds) && !is_oversized(bounds, fusion_))
        surfaces.back().triangles.push_back({corners, label_of(chunk, face)});
    }
  }
  return surfaces;
}

void TeamMap::update() {
  for (const Box& box : changed_) {
    const std::vector<RobotSurface> surfaces = surfaces_near(box);
    FusedBox fused;
    if (!surfaces.empty()) fused = fusion_.fuse(box, surfaces);
    if (fused.faces.empty()) {
      boxes_.erase(box);
    } else {
      boxes_.insert_or_assign(box, std::move(fused));
    }
  }
  changed_.clear();
}

LabelledMesh TeamMap::mesh() const {
  LabelledMesh mesh;
  std::map<GridEdge, std::uint32_t> shared;  // vertices on the sides of boxes
  bool labelled = false;
  for (const auto& [box, fused] : boxes_) {
    std::vector<std::uint32_t> index;
    for (std::size_t v = 0; v < fused.vertices.size(); ++v) {
      const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
      const GridEdge& edge = fused.edges[v];
      const bool inside = std::ranges::all_of(
          edge.voxel, [](std::int32_t c) { return c % SurfaceFusion::kSide != 0; });
      const std::uint32_t place = inside ? next : shared.try_emplace(edge, next).first->second;
      index.push_back(place);
      if (place != next) continue;
      mesh.vertices.push_back(fused.vertices[v]);
      mesh.labels.push_back(fused.labels[v]);
      labelled = labelled || fused.labels[v] != 0;
    }
    for (const auto& [a, b, c] : fused.faces) mesh.faces.push_back({index[a], index[b], index[c]});
  }
  if (!labelled) mesh.labels.clear();
  return mesh;
}

LabelledMesh resampled(const LabelledMesh& mesh, double voxel_m) {
  TeamMap map(voxel_m);
  for (MeshChunk& chunk : split_mesh(mesh, 0, 0, {}).chunks) map.add(std::move(chunk));
  map.update();
  return map.mesh();
}

}  // namespace km
