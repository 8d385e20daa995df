#include "modules/team_map/team_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "modules/team_map/surface_fusion.hpp"

namespace km {
namespace {

using Box = std::array<std::int32_t, 3>;

std::array<Eigen::Vector3f, 3> corners_of(const PlacedChunk& placed,
                                          const MeshChunk::Triple& face) {
  return {placed.vertices[face[0]], placed.vertices[face[1]], placed.vertices[face[2]]};
}

// The label of two corners, or else of the first.
LabelId label_of(const MeshChunk& chunk, const MeshChunk::Triple& face) {
  if (chunk.labels.empty()) return 0;
  const LabelId a = chunk.labels[face[0]], b = chunk.labels[face[1]], c = chunk.labels[face[2]];
  return b == c ? b : a;
}

// Black without colours.
std::array<LabelledMesh::Color, 3> colors_of(const MeshChunk& chunk,
                                             const MeshChunk::Triple& face) {
  std::array<LabelledMesh::Color, 3> colors = {};
  if (!chunk.colors.empty())
    for (std::size_t c = 0; c < 3; ++c) colors[c] = unpacked_color(chunk.colors[face[c]]);
  return colors;
}

Eigen::AlignedBox3f bounds_of(const std::array<Eigen::Vector3f, 3>& corners, float margin_m) {
  Eigen::AlignedBox3f bounds(corners[0]);
  bounds.extend(corners[1]).extend(corners[2]);
  const Eigen::Vector3f margin = Eigen::Vector3f::Constant(margin_m);
  return {bounds.min() - margin, bounds.max() + margin};
}

// True for a face that no mapper makes. It could be near any number of boxes, or in a box without a
// number, because poses that a robot states may stretch its chunks.
bool is_left_out(const Eigen::AlignedBox3f& bounds, const SurfaceFusion& fusion) {
  constexpr float kFarthest_m = 1e7F;
  return bounds.sizes().maxCoeff() > fusion.side_m() + 2.0F * fusion.reach_m() ||
         !(bounds.min().minCoeff() > -kFarthest_m && bounds.max().maxCoeff() < kFarthest_m);
}

// Chunks with faces near a box, in ascending order of their keys.
struct NearChunks {
  std::vector<const PlacedChunk*> own;    // chunks of the level of the box
  std::vector<const PlacedChunk*> finer;  // chunks from smaller voxels
};

// By level and box: the voxels of level k are 2^k times as large as the smallest.
using ChunksOfBoxes = std::map<std::pair<int, Box>, NearChunks>;

// Calls visit(box) for the boxes that the faces of the chunk may change, some of them repeatedly.
// Returns the extent of these faces.
template <typename Visit>
Eigen::AlignedBox3f visit_boxes(const PlacedChunk& chunk, const SurfaceFusion& fusion,
                                const Visit& visit) {
  Eigen::AlignedBox3f extent;
  std::optional<std::pair<Box, Box>> last;
  for (const MeshChunk::Triple& face : chunk.chunk->faces) {
    const Eigen::AlignedBox3f bounds = bounds_of(corners_of(chunk, face), fusion.reach_m());
    if (is_left_out(bounds, fusion)) continue;
    extent.extend(bounds);
    const std::pair<Box, Box> range{fusion.box_of(bounds.min()), fusion.box_of(bounds.max())};
    // Neighbours in the list are usually neighbours in space.
    if (last == range) continue;
    last = range;
    const auto& [low, high] = range;
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z) visit(Box{x, y, z});
  }
  return extent;
}

void add_once(std::vector<const PlacedChunk*>& chunks, const PlacedChunk& chunk) {
  if (chunks.empty() || chunks.back() != &chunk) chunks.push_back(&chunk);
}

// The surface of each robot near a box.
std::vector<RobotSurface> surfaces_near(const Box& box,
                                        const std::vector<const PlacedChunk*>& chunks,
                                        const SurfaceFusion& fusion) {
  std::vector<RobotSurface> surfaces;
  const Eigen::Vector3f low =
      fusion.side_m() * Eigen::Vector3i(box[0], box[1], box[2]).cast<float>();
  const Eigen::AlignedBox3f space(low, low + Eigen::Vector3f::Constant(fusion.side_m()));
  for (const PlacedChunk* placed : chunks) {
    const MeshChunk& chunk = *placed->chunk;
    if (surfaces.empty() || surfaces.back().robot != chunk.key.robot)
      surfaces.push_back({.robot = chunk.key.robot, .triangles = {}});
    for (const MeshChunk::Triple& face : chunk.faces) {
      const auto corners = corners_of(*placed, face);
      const Eigen::AlignedBox3f bounds = bounds_of(corners, fusion.reach_m());
      if (space.intersects(bounds) && !is_left_out(bounds, fusion))
        surfaces.back().triangles.push_back(
            {corners, label_of(chunk, face), colors_of(chunk, face)});
    }
  }
  return surfaces;
}

// Appends boxes to a mesh. Boxes share the vertices on their sides.
class BoxJoiner {
 public:
  explicit BoxJoiner(LabelledMesh& mesh) : mesh_(mesh) {}

  void append(const FusedBox& box) {
    std::vector<std::uint32_t> index;
    for (std::size_t v = 0; v < box.vertices.size(); ++v) {
      const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
      const bool is_inside = std::ranges::all_of(
          box.edges[v].voxel, [](std::int32_t c) { return c % SurfaceFusion::kSide != 0; });
      const std::uint32_t place =
          is_inside ? next : shared_.try_emplace(box.edges[v], next).first->second;
      index.push_back(place);
      if (place != next) continue;
      mesh_.vertices.push_back(box.vertices[v]);
      mesh_.labels.push_back(box.labels[v]);
      mesh_.colors.push_back(box.colors[v]);
    }
    for (const auto& [a, b, c] : box.faces) mesh_.faces.push_back({index[a], index[b], index[c]});
  }

 private:
  LabelledMesh& mesh_;
  std::map<GridEdge, std::uint32_t> shared_;
};

// The side of the smallest voxels, see fuse_chunks().
double finest_voxel_m(const std::vector<PlacedChunk>& chunks) {
  std::map<RobotId, float> of_robot;
  for (const PlacedChunk& chunk : chunks)
    if (const float voxel_m = chunk.chunk->voxel_m; voxel_m > 0.0F) {
      float& smallest = of_robot.try_emplace(chunk.chunk->key.robot, voxel_m).first->second;
      smallest = std::min(smallest, voxel_m);
    }
  std::vector<float> sizes = {};
  for (const auto& [robot, size] : of_robot) sizes.push_back(size);
  std::ranges::sort(sizes);
  return sizes.empty() ? 0.1 : static_cast<double>(sizes[sizes.size() / 2]);
}

int level_of(const MeshChunk& chunk, double finest_m) {
  constexpr int kLevels = 8;
  const double ratio = static_cast<double>(chunk.voxel_m) / finest_m;
  return ratio > 1.0 ? std::min(static_cast<int>(std::lround(std::log2(ratio))), kLevels - 1) : 0;
}

// The key with the largest value, the lowest of several; 0 without any.
template <typename Value>
RobotId most_of(const std::map<RobotId, Value>& values) {
  const auto most = std::ranges::max_element(
      values, [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == values.end() ? RobotId{0} : most->first;
}

RobotId anchor_of(const std::vector<PlacedChunk>& chunks) {
  std::map<RobotId, std::map<RobotId, std::size_t>> of_robot;
  std::map<RobotId, std::pair<std::size_t, std::size_t>> votes;  // robots, chunks
  for (const PlacedChunk& chunk : chunks) {
    ++of_robot[chunk.chunk->key.robot][chunk.anchor];
    ++votes[chunk.anchor].second;
  }
  for (const auto& [robot, anchors] : of_robot) ++votes[most_of(anchors)].first;
  return most_of(votes);
}

// Largest share of one robot, for counts of all robots with a larger sum than `total`.
std::size_t share_of(std::vector<std::size_t> counts, std::size_t total) {
  std::ranges::sort(counts);
  std::size_t share = total;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    share = total / (counts.size() - k);
    if (counts[k] > share) break;
    total -= counts[k];
  }
  return share;
}

// Bounds the number of boxes, see fuse_chunks(). Returns the number of boxes that robots lose.
std::size_t limit(ChunksOfBoxes& boxes, std::size_t max_boxes) {
  if (boxes.size() <= max_boxes) return 0;
  std::map<RobotId, std::size_t> counts, taken;
  const auto for_each_robot = [](const std::vector<const PlacedChunk*>& near, const auto& action) {
    for (std::size_t k = 0; k < near.size(); ++k)
      if (k == 0 || near[k]->chunk->key.robot != near[k - 1]->chunk->key.robot)
        action(near[k]->chunk->key.robot);
  };
  for (const auto& [box, near] : boxes)
    for_each_robot(near.own, [&](RobotId robot) { ++counts[robot]; });
  std::vector<std::size_t> sizes;
  for (const auto& [robot, count] : counts) sizes.push_back(count);
  const std::size_t share = share_of(sizes, max_boxes);
  std::size_t lost = 0;
  for (auto& [box, near] : boxes) {
    for_each_robot(near.own, [&](RobotId robot) { lost += ++taken[robot] > share ? 1U : 0U; });
    std::erase_if(near.own, [&](const PlacedChunk* placed) {
      return taken[placed->chunk->key.robot] > share;
    });
  }
  std::erase_if(boxes, [](const auto& entry) { return entry.second.own.empty(); });
  return lost;
}

}  // namespace

TeamMap fuse_chunks(const std::vector<PlacedChunk>& chunks, std::size_t max_boxes) {
  const double finest_m = finest_voxel_m(chunks);
  std::map<int, SurfaceFusion> fusions;  // by level
  TeamMap map{.anchor = anchor_of(chunks), .mesh = {}, .extents = {}};
  ChunksOfBoxes boxes;
  bool is_labelled = false, is_coloured = false;
  for (const PlacedChunk& chunk : chunks) {
    if (chunk.anchor != map.anchor) {
      ++map.other_frames;
      continue;
    }
    const int level = level_of(*chunk.chunk, finest_m);
    const SurfaceFusion& fusion =
        fusions.try_emplace(level, std::ldexp(finest_m, level)).first->second;
    map.extents[chunk.chunk->key.robot].extend(visit_boxes(chunk, fusion, [&](const Box& box) {
      add_once(boxes[{level, box}].own, chunk);
    }));
    is_labelled = is_labelled || !chunk.chunk->labels.empty();
    is_coloured = is_coloured || !chunk.chunk->colors.empty();
  }
  std::erase_if(map.extents, [](const auto& entry) { return entry.second.isEmpty(); });
  map.left_out = limit(boxes, max_boxes);
  for (const PlacedChunk& chunk : chunks)
    for (const auto& [level, fusion] : fusions)
      if (chunk.anchor == map.anchor && level > level_of(*chunk.chunk, finest_m))
        visit_boxes(chunk, fusion, [&](const Box& box) {
          if (const auto found = boxes.find({level, box}); found != boxes.end())
            add_once(found->second.finer, chunk);
        });
  std::map<int, BoxJoiner> joiners;
  for (const auto& [place, near] : boxes) {
    const auto& [level, box] = place;
    SurfaceFusion& fusion = fusions.at(level);
    std::vector<RobotSurface::Triangle> finer;
    for (const RobotSurface& surface : surfaces_near(box, near.finer, fusion))
      finer.insert(finer.end(), surface.triangles.begin(), surface.triangles.end());
    joiners.try_emplace(level, map.mesh)
        .first->second.append(fusion.fuse(box, surfaces_near(box, near.own, fusion), finer));
  }
  if (!is_labelled) map.mesh.labels.clear();
  if (!is_coloured) map.mesh.colors.clear();
  return map;
}

Eigen::AlignedBox2f plan_of(const std::map<RobotId, Eigen::AlignedBox3f>& extents, double cell_m,
                            double max_cells) {
  const auto plan = [](const Eigen::AlignedBox3f& extent) {
    return Eigen::AlignedBox2f(extent.min().head<2>(), extent.max().head<2>());
  };
  const auto cells = [cell_m](const Eigen::AlignedBox2f& box) {
    return (box.sizes().cast<double>() / cell_m).array().ceil().prod();
  };
  Eigen::AlignedBox2f best;
  std::size_t most = 0;
  for (const auto& [seed, extent] : extents) {
    Eigen::AlignedBox2f around;
    std::map<RobotId, Eigen::AlignedBox3f> others = extents;
    std::size_t count = 0;
    for (RobotId next = seed;; ++count) {
      const Eigen::AlignedBox2f grown = around.merged(plan(others.at(next)));
      if (cells(grown) > max_cells) break;
      around = grown;
      others.erase(next);
      if (others.empty()) {
        ++count;
        break;
      }
      next = std::ranges::min_element(others, {}, [&](const auto& other) {
               return cells(around.merged(plan(other.second)));
             })->first;
    }
    if (count > most) best = around;
    most = std::max(most, count);
  }
  return best;
}

LabelledMesh resampled(const LabelledMesh& mesh, double voxel_m) {
  SplitMesh pieces = split_mesh(mesh, 0, 0, {});
  std::vector<PlacedChunk> chunks;
  for (MeshChunk& chunk : pieces.chunks) {
    chunk.voxel_m = static_cast<float>(voxel_m);
    chunks.push_back(place(chunk, nullptr));
  }
  return fuse_chunks(chunks).mesh;
}

}  // namespace km
