#include "modules/semantic_mapping/block_map.hpp"

#include <cassert>

namespace km {

BlockMap::BlockMap() : slots_(1024) {}

std::uint64_t BlockMap::key_of(const Eigen::Vector3i& position) {
  const auto part = [](int value) { return static_cast<std::uint64_t>(value + kReach); };
  return part(position.x()) | part(position.y()) << 21U | part(position.z()) << 42U;
}

std::size_t BlockMap::home_of(std::uint64_t key) const {
  // Fibonacci hashing after mixing the high parts into the low.
  const std::uint64_t mixed = (key ^ key >> 29U) * 0x9E3779B97F4A7C15U;
  return static_cast<std::size_t>(mixed >> 32U) & (slots_.size() - 1);
}

std::size_t BlockMap::slot_of(std::uint64_t key) const {
  std::size_t slot = home_of(key);
  while (slots_[slot].key != key && slots_[slot].key != kFree)
    slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

const VoxelBlock* BlockMap::find(const Eigen::Vector3i& position) const {
  if (!in_reach(position)) return nullptr;
  const Slot& slot = slots_[slot_of(key_of(position))];
  return slot.key == kFree ? nullptr : blocks_[slot.block].get();
}

VoxelBlock& BlockMap::insert(const Eigen::Vector3i& position) {
  assert(in_reach(position) && find(position) == nullptr);
  if (2 * (blocks_.size() + 1) > slots_.size()) grow();
  const std::uint64_t key = key_of(position);
  slots_[slot_of(key)] = {key, static_cast<std::uint32_t>(blocks_.size())};
  blocks_.push_back(std::make_unique<VoxelBlock>());
  blocks_.back()->position = position;
  return *blocks_.back();
}

void BlockMap::erase(const Eigen::Vector3i& position) {
  std::size_t hole = slot_of(key_of(position));
  assert(slots_[hole].key != kFree);
  const std::uint32_t block = slots_[hole].block;
  if (block + 1 != blocks_.size()) {  // the last block moves to its index
    blocks_[block] = std::move(blocks_.back());
    slots_[slot_of(key_of(blocks_[block]->position))].block = block;
  }
  blocks_.pop_back();

  // Later slots move up if the hole is between them and their home.
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t next = (hole + 1) & mask; slots_[next].key != kFree; next = (next + 1) & mask) {
    const std::size_t from_home = (next - home_of(slots_[next].key)) & mask;
    if (from_home < ((next - hole) & mask)) continue;
    slots_[hole] = slots_[next];
    hole = next;
  }
  slots_[hole] = {};
}

void BlockMap::grow() {
  slots_.assign(2 * slots_.size(), {});
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const std::uint64_t key = key_of(blocks_[i]->position);
    slots_[slot_of(key)] = {key, static_cast<std::uint32_t>(i)};
  }
}

}  // namespace km
