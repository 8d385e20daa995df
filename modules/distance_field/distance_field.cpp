#include "modules/distance_field/distance_field.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace km {
namespace {

constexpr std::uint64_t kColumnX0 = 0x0101010101010101, kColumnX7 = kColumnX0 << 7U;
constexpr int kNoSurface = 1 << 28;  // beyond every squared distance [voxels^2]

bool any(const BlockBits& bits) {
  return std::ranges::any_of(bits, [](std::uint64_t word) { return word != 0; });
}

bool bit(const BlockBits& bits, int x, int y, int z) {
  return (bits[static_cast<std::size_t>(z)] >> (x + kBlockSide * y) & 1U) != 0;
}

// The transform along the rows (Felzenszwalb and Huttenlocher, "Distance Transforms of Sampled
// Functions", 2012, Sec. 2): the minimum of f(q) + (p - q)^2 over all q within reach of p.
Eigen::ArrayXXi transformed(const Eigen::ArrayXXi& f, int reach) {
  Eigen::ArrayXXi result = f;
  for (Eigen::Index d = 1; d <= std::min<Eigen::Index>(reach, f.rows() - 1); ++d) {
    const Eigen::Index rows = f.rows() - d;
    const int squared = static_cast<int>(d * d);
    result.topRows(rows) = result.topRows(rows).min(f.bottomRows(rows) + squared);
    result.bottomRows(rows) = result.bottomRows(rows).min(f.topRows(rows) + squared);
  }
  return result;
}

}  // namespace

// Voxels behind a surface beside an observed voxel in front of it, by shifted copies of the bits.
BlockBits DistanceField::surface_of(const BlockSpace& block) const {
  const auto front = [](const BlockSpace* other, int z) {
    return other == nullptr ? 0
                            : other->observed[static_cast<std::size_t>(z)] &
                                  ~other->inside[static_cast<std::size_t>(z)];
  };
  const auto beside = [&](int axis, int step) -> const BlockSpace* {
    Eigen::Vector3i next = block.position;
    next[axis] += step;
    const auto found = blocks_.find(next);
    return found == blocks_.end() ? nullptr : &found->second;
  };
  const std::array<const BlockSpace*, 6> around = {beside(0, -1), beside(0, 1),  beside(1, -1),
                                                   beside(1, 1),  beside(2, -1), beside(2, 1)};
  BlockBits surface = {};
  for (int z = 0; z < kBlockSide; ++z) {
    const std::uint64_t own = front(&block, z);
    const std::uint64_t near =
        ((own & ~kColumnX7) << 1U) | ((front(around[0], z) & kColumnX7) >> 7U) |
        ((own & ~kColumnX0) >> 1U) | ((front(around[1], z) & kColumnX0) << 7U) | (own << 8U) |
        (front(around[2], z) >> 56U) | (own >> 8U) | (front(around[3], z) << 56U) |
        (z > 0 ? front(&block, z - 1) : front(around[4], kBlockSide - 1)) |
        (z < kBlockSide - 1 ? front(&block, z + 1) : front(around[5], 0));
    surface[static_cast<std::size_t>(z)] = block.inside[static_cast<std::size_t>(z)] & near;
  }
  return surface;
}

void DistanceField::set(const SpaceChanges& changes) {
  for (const BlockSpace& change : changes) {
    if (!any(change.observed)) {
      blocks_.erase(change.position);
      continue;
    }
    BlockSpace& block = blocks_[change.position] = change;
    for (std::size_t z = 0; z < block.inside.size(); ++z) block.inside[z] &= block.observed[z];
  }
}

// One transform per axis. The first one, along z, is at a single height.
std::vector<DistanceField::SlicePoint> DistanceField::slice(double z_m) const {
  const int slice_z = static_cast<int>(std::lround(z_m / voxel_m_));
  const int reach = static_cast<int>(std::ceil(max_m_ / voxel_m_)) + 1;
  std::vector<const BlockSpace*> blocks;
  Eigen::Array3i low = Eigen::Array3i::Constant(kNoSurface), high = -low;
  for (const auto& [position, block] : blocks_) {
    if (position.z() != slice_z >> 3) continue;
    blocks.push_back(&block);
    low = low.min(kBlockSide * position.array() - reach);
    high = high.max(kBlockSide * (position.array() + 1) + reach);
  }
  if (blocks.empty()) return {};
  std::ranges::sort(blocks, BlockOrder(), &BlockSpace::position);
  Eigen::ArrayXXi squared =
      Eigen::ArrayXXi::Constant(high.x() - low.x(), high.y() - low.y(), kNoSurface);
  for (const auto& [position, block] : blocks_) {
    const int below = kBlockSide * position.z() - slice_z;
    if (below > reach || below + kBlockSide <= -reach) continue;
    const BlockBits surface = surface_of(block);
    for (int z = 0; z < kBlockSide; ++z)
      for (std::uint64_t word = surface[static_cast<std::size_t>(z)]; word != 0; word &= word - 1) {
        const int place = std::countr_zero(word);
        const int x = kBlockSide * position.x() + place % kBlockSide - low.x();
        const int y = kBlockSide * position.y() + place / kBlockSide - low.y();
        if (x >= 0 && y >= 0 && x < squared.rows() && y < squared.cols())
          squared(x, y) = std::min(squared(x, y), (below + z) * (below + z));
      }
  }
  squared = transformed(squared, reach);
  squared = transformed(squared.transpose(), reach);
  std::vector<SlicePoint> points;
  for (const BlockSpace* block : blocks)
    for (int y = 0; y < kBlockSide; ++y)
      for (int x = 0; x < kBlockSide; ++x) {
        if (!bit(block->observed, x, y, slice_z & 7)) continue;
        const Eigen::Vector3i voxel(kBlockSide * block->position.x() + x,
                                    kBlockSide * block->position.y() + y, slice_z);
        const double d =
            std::sqrt(static_cast<double>(squared(voxel.y() - low.y(), voxel.x() - low.x())));
        const double signed_voxels = bit(block->inside, x, y, slice_z & 7) ? -(d + 0.5) : d - 0.5;
        points.push_back(
            {static_cast<float>(voxel_m_) * voxel.cast<float>(),
             static_cast<float>(std::clamp(signed_voxels * voxel_m_, -max_m_, max_m_))});
      }
  return points;
}

}  // namespace km
