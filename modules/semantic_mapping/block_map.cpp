#include "modules/semantic_mapping/block_map.hpp"

#include <cassert>

namespace km {

// Fibonacci hashing after mixing the high parts into the low.
std::size_t BlockHash::operator()(const Eigen::Vector3i& position) const noexcept {
  const auto part = [](int value) { return static_cast<std::uint64_t>(value + BlockMap::kReach); };
  const std::uint64_t key =
      part(position.x()) | part(position.y()) << 21U | part(position.z()) << 42U;
  return static_cast<std::size_t>(((key ^ key >> 29U) * 0x9E3779B97F4A7C15U) >> 32U);
}

const VoxelBlock* BlockMap::find(const Eigen::Vector3i& position) const {
  if (!in_reach(position)) return nullptr;
  const auto found = index_.find(position);
  return found == index_.end() ? nullptr : blocks_[found->second].get();
}

VoxelBlock& BlockMap::insert(const Eigen::Vector3i& position) {
  assert(in_reach(position) && find(position) == nullptr);
  index_.emplace(position, blocks_.size());
  blocks_.push_back(std::make_unique<VoxelBlock>());
  blocks_.back()->position = position;
  return *blocks_.back();
}

void BlockMap::erase(const Eigen::Vector3i& position) {
  const auto found = index_.find(position);
  assert(found != index_.end());
  const std::size_t block = found->second;
  index_.erase(found);
  if (block + 1 != blocks_.size()) {  // the last block moves to its index
    blocks_[block] = std::move(blocks_.back());
    index_[blocks_[block]->position] = block;
  }
  blocks_.pop_back();
}

}  // namespace km
