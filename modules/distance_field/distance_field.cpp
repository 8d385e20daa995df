#include "modules/distance_field/distance_field.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/core/config.hpp"

namespace km {
namespace {

constexpr std::uint64_t kColumnX0 = 0x0101010101010101, kColumnX7 = kColumnX0 << 7U;

bool any(const BlockBits& bits) {
  return std::ranges::any_of(bits, [](std::uint64_t word) { return word != 0; });
}

bool bit(const BlockBits& bits, int x, int y, int z) {
  return (bits[static_cast<std::size_t>(z)] >> (x + kBlockSide * y) & 1U) != 0;
}

double checked_voxel(double voxel_m, double max_m) {
  if (!(voxel_m > 0.0) || max_m > DistanceField::kMaxReach * voxel_m)
    throw std::invalid_argument("distance field: " + shortest_text(max_m) + " m in voxels of " +
                                shortest_text(voxel_m) + " m");
  return voxel_m;
}

}  // namespace

DistanceField::DistanceField(double max_distance_m, double voxel_size_m)
    : voxel_m_(checked_voxel(voxel_size_m, max_distance_m)),
      max_m_(max_distance_m),
      reach_(static_cast<int>(std::ceil(max_m_ / voxel_m_)) + 1),
      reach_blocks_((reach_ + kBlockSide - 1) / kBlockSide) {}

const DistanceField::Block* DistanceField::find(const Eigen::Vector3i& position) const {
  const auto found = blocks_.find(position);
  return found == blocks_.end() ? nullptr : found->second.get();
}

// Voxels behind a surface beside an observed voxel in front of it, by shifted copies of the bits.
BlockBits DistanceField::surface_of(const Eigen::Vector3i& position, const Block& block) const {
  const auto front = [](const Block* other, int z) {
    return other == nullptr ? 0
                            : other->observed[static_cast<std::size_t>(z)] &
                                  ~other->inside[static_cast<std::size_t>(z)];
  };
  const auto beside = [&](int axis, int step) {
    Eigen::Vector3i next = position;
    next[axis] += step;
    return find(next);
  };
  const std::array<const Block*, 6> around = {beside(0, -1), beside(0, 1),  beside(1, -1),
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
    auto& block = blocks_[change.position];
    if (block == nullptr) block = std::make_unique<Block>();
    block->observed = change.observed;
    for (std::size_t z = 0; z < change.inside.size(); ++z)
      block->inside[z] = change.inside[z] & change.observed[z];
  }
  is_surface_outdated_ = true;
  for (const auto& [position, block] : blocks_) block->outdated = true;
}

void DistanceField::find_surface() {
  for (const auto& [position, block] : blocks_) block->surface = surface_of(position, *block);
  is_surface_outdated_ = false;
}

void DistanceField::compute(const std::vector<Eigen::Vector3i>& targets) {
  if (targets.empty()) return;
  if (is_surface_outdated_) find_surface();
  Box box{targets.front(), targets.front()};
  std::vector<DistanceTarget> outputs;
  for (const Eigen::Vector3i& target : targets) {
    box = {box.low.cwiseMin(target), box.high.cwiseMax(target)};
    Block& block = *blocks_.at(target);
    outputs.push_back({target, &block.squared});
    block.outdated = false;
  }
  find_surface_distances(surface_near({box.low, box.high.array() + 1}), reach_, outputs);
}

// The surface within reach of `box`.
SurfaceBox DistanceField::surface_near(const Box& box) const {
  std::vector<std::pair<Eigen::Vector3i, const Block*>> found;
  Eigen::Vector3i low = box.high, high = box.low;
  for (const auto& [position, block] : blocks_) {
    const auto at = position.array();
    if (!any(block->surface) || (at < box.low.array() - reach_blocks_).any() ||
        (at >= box.high.array() + reach_blocks_).any())
      continue;
    low = found.empty() ? position : low.cwiseMin(position);
    high = found.empty() ? position : high.cwiseMax(position);
    found.emplace_back(position, block.get());
  }
  if (found.empty()) return {};
  const Eigen::Vector3i blocks = high - low + Eigen::Vector3i::Ones();
  SurfaceBox surface{low, blocks, std::vector<BlockBits>(static_cast<std::size_t>(blocks.prod()))};
  for (const auto& [position, block] : found) {
    const Eigen::Vector3i at = position - low;
    surface
        .surface[static_cast<std::size_t>(at.x() + blocks.x() * (at.y() + blocks.y() * at.z()))] =
        block->surface;
  }
  return surface;
}

double DistanceField::signed_distance(const Block& block, int x, int y, int z) const {
  const std::uint16_t squared = block.squared[voxel_index(x, y, z)];
  const bool is_inside = bit(block.inside, x, y, z);
  if (squared == kBeyondReach) return is_inside ? -max_m_ : max_m_;
  const double d = std::sqrt(static_cast<double>(squared));
  return std::clamp((is_inside ? -(d + 0.5) : d - 0.5) * voxel_m_, -max_m_, max_m_);
}

std::optional<double> DistanceField::at_voxel(const Eigen::Vector3i& voxel) {
  const Eigen::Vector3i position = voxel.unaryExpr([](int v) { return v >> 3; });
  const Block* block = find(position);
  if (block == nullptr) return std::nullopt;
  const Eigen::Vector3i in = voxel - position * kBlockSide;
  if (!bit(block->observed, in.x(), in.y(), in.z())) return std::nullopt;
  if (block->outdated) compute({position});
  return signed_distance(*block, in.x(), in.y(), in.z());
}

std::vector<DistanceField::SlicePoint> DistanceField::slice(double z_m) {
  const int voxel_z = static_cast<int>(std::lround(z_m / voxel_m_));
  std::vector<Eigen::Vector3i> positions, outdated;
  for (const auto& [position, block] : blocks_) {
    if (position.z() != voxel_z >> 3) continue;
    positions.push_back(position);
    if (block->outdated) outdated.push_back(position);
  }
  compute(outdated);
  std::ranges::sort(positions, BlockOrder());
  std::vector<SlicePoint> points;
  for (const Eigen::Vector3i& position : positions)
    for (int y = 0; y < kBlockSide; ++y)
      for (int x = 0; x < kBlockSide; ++x) {
        Eigen::Vector3i voxel = position * kBlockSide + Eigen::Vector3i(x, y, 0);
        voxel.z() = voxel_z;
        if (const auto distance = at_voxel(voxel))
          points.push_back(
              {voxel.cast<float>() * static_cast<float>(voxel_m_), static_cast<float>(*distance)});
      }
  return points;
}

}  // namespace km
