#include "modules/semantic_mapping/marching_cubes.hpp"

#include <algorithm>

namespace km {
namespace {

constexpr int kNone = -1;

// Corners of the faces, counter-clockwise seen from outside the cell.
constexpr std::array<std::array<int, 4>, 6> kFaces = {{
    {0, 4, 6, 2},
    {1, 3, 7, 5},  // x = 0, x = 1
    {0, 1, 5, 4},
    {2, 6, 7, 3},  // y
    {0, 2, 3, 1},
    {4, 5, 7, 6},  // z
}};

// The edge between two corners that differ in one bit.
int edge_between(int a, int b) {
  const int low = a & b;
  for (int edge = 0; edge < MarchingCubes::kEdges; ++edge)
    if (MarchingCubes::first_corner_of_edge(edge) == low &&
        (low | 1 << MarchingCubes::axis_of_edge(edge)) == (a | b))
      return edge;
  return kNone;
}

// For every edge that the surface cuts, the next edge on its loop. On a face seen from outside, the
// cut leads from the begin of a run of negative corners to its end. The edge at the end is the
// begin of a run on the other face that shares the edge.
std::array<int, MarchingCubes::kEdges> successors(unsigned negative) {
  const auto is_negative = [&](int corner) { return (negative >> corner & 1U) != 0; };
  std::array<int, MarchingCubes::kEdges> next;
  next.fill(kNone);
  for (const auto& face : kFaces)
    for (std::size_t begin = 0; begin < 4; ++begin) {
      if (is_negative(face[begin]) || !is_negative(face[(begin + 1) % 4])) continue;
      std::size_t end = begin + 1;
      while (is_negative(face[(end + 1) % 4])) ++end;
      const int from = edge_between(face[begin], face[(begin + 1) % 4]);
      const int to = edge_between(face[end % 4], face[(end + 1) % 4]);
      next[static_cast<std::size_t>(from)] = to;
    }
  return next;
}

}  // namespace

MarchingCubes::MarchingCubes() {
  for (unsigned negative = 0; negative < 256; ++negative) {
    first_[negative] = static_cast<std::uint16_t>(triangles_.size());
    auto next = successors(negative);
    for (std::size_t start = 0; start < kEdges; ++start) {
      std::vector<std::uint8_t> loop;
      for (std::size_t edge = start; next[edge] != kNone;) {
        loop.push_back(static_cast<std::uint8_t>(edge));
        const auto following = static_cast<std::size_t>(next[edge]);
        next[edge] = kNone;
        edge = following;
      }
      for (std::size_t i = 2; i < loop.size(); ++i)
        triangles_.push_back({loop[0], loop[i - 1], loop[i]});
    }
  }
  first_[256] = static_cast<std::uint16_t>(triangles_.size());
}

BlockCells::BlockCells(VoxelBlock& block, BlockMap& map) : voxel_m_(map.voxel_m()) {
  blocks_[0] = &block;
  for (int i = 1; i < 8; ++i)
    blocks_[static_cast<std::size_t>(i)] =
        map.find(block.position + Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2 & 1));
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y) copy_row(y, z, map);
  unsigned negative = 0, positive = 0;
  for (std::size_t row = 0; row < negative_.size(); ++row) {
    negative |= negative_[row] & observed_[row];
    positive |= static_cast<unsigned>(~negative_[row]) & observed_[row];
  }
  any_ = negative != 0 && positive != 0;
}

void BlockCells::copy_row(int y, int z, const BlockMap& map) {
  const std::size_t row = row_of(y, z);
  const auto first = static_cast<std::size_t>((y >> 3) << 1 | (z >> 3) << 2);
  const std::size_t voxel = voxel_index(0, y & 7, z & 7);
  unsigned negative = 0, observed = 0;
  if (const VoxelBlock* block = blocks_[first]) {
    const float* distance = &block->distance[voxel];
    std::copy_n(distance, kBlockSide, values_[row].data());
    for (unsigned x = 0; x < kBlockSide; ++x) {
      negative |= distance[x] < 0.0F ? 1U << x : 0U;
      observed |= map.knows(*block, voxel + x) ? 1U << x : 0U;
    }
  }
  if (const VoxelBlock* block = blocks_[first + 1]) {
    values_[row][kBlockSide] = block->distance[voxel];
    negative |= block->distance[voxel] < 0.0F ? 1U << kBlockSide : 0U;
    observed |= map.knows(*block, voxel) ? 1U << kBlockSide : 0U;
  }
  negative_[row] = static_cast<std::uint16_t>(negative);
  observed_[row] = static_cast<std::uint16_t>(observed);
}

bool BlockCells::is_finer(int x, int y, int z, std::span<const BlockMap> finer) const {
  const auto row = static_cast<std::size_t>((y & 7) + kBlockSide * (z & 7));
  if ((block_of(x, y, z).finer_rows[row] >> (x & 7) & 1) != 0) return true;
  Eigen::Vector3i voxel = kBlockSide * blocks_[0]->position + Eigen::Vector3i(x, y, z);
  for (auto map = finer.rbegin(); map != finer.rend(); ++map) {
    voxel *= 2;
    const Eigen::Vector3i inside = voxel.unaryExpr([](int c) { return c & (kBlockSide - 1); });
    const VoxelBlock* block = map->find((voxel - inside) / kBlockSide);
    if (block != nullptr && map->knows(*block, voxel_index(inside.x(), inside.y(), inside.z())))
      return true;
  }
  return false;
}

unsigned BlockCells::crossed(int y, int z) const {
  unsigned observed = ~0U, any = 0, all = ~0U;
  for (const std::size_t row :
       {row_of(y, z), row_of(y + 1, z), row_of(y, z + 1), row_of(y + 1, z + 1)}) {
    observed &= observed_[row];
    any |= negative_[row];
    all &= negative_[row];
  }
  return observed & (observed >> 1U) & (any | any >> 1U) & ~(all & all >> 1U) & 0xFFU;
}

unsigned BlockCells::negative_corners(int x, int y, int z) const {
  const auto pair = [&](std::size_t row) {
    return static_cast<unsigned>(negative_[row]) >> static_cast<unsigned>(x) & 3U;
  };
  return pair(row_of(y, z)) | pair(row_of(y + 1, z)) << 2U | pair(row_of(y, z + 1)) << 4U |
         pair(row_of(y + 1, z + 1)) << 6U;
}

}  // namespace km
