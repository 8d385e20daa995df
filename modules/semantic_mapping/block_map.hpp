#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "modules/semantic_mapping/voxel_block.hpp"

namespace km {

/// The blocks of a map, hashed by their position (open addressing, linear probing). References to
/// blocks stay valid until they are erased. The order of blocks() follows from the calls alone.
class BlockMap {
 public:
  /// Positions are representable from -kReach to kReach - 1 along every axis.
  static constexpr int kReach = 1 << 20;

  [[nodiscard]] static bool in_reach(const Eigen::Vector3i& position) {
    return (position.array() >= -kReach).all() && (position.array() < kReach).all();
  }

  BlockMap();

  /// nullptr if there is none.
  [[nodiscard]] VoxelBlock* find(const Eigen::Vector3i& position) {
    return const_cast<VoxelBlock*>(std::as_const(*this).find(position));
  }
  [[nodiscard]] const VoxelBlock* find(const Eigen::Vector3i& position) const;

  /// A new, empty block. Preconditions: none there yet, in reach.
  VoxelBlock& insert(const Eigen::Vector3i& position);

  /// Precondition: there is one.
  void erase(const Eigen::Vector3i& position);

  [[nodiscard]] std::size_t size() const { return blocks_.size(); }
  [[nodiscard]] const std::vector<std::unique_ptr<VoxelBlock>>& blocks() const { return blocks_; }

 private:
  struct Slot {
    std::uint64_t key = kFree;
    std::uint32_t block = 0;  // in blocks_
  };
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};

  [[nodiscard]] static std::uint64_t key_of(const Eigen::Vector3i& position);
  [[nodiscard]] std::size_t home_of(std::uint64_t key) const;
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const;  // its own, or the free one
  void grow();

  std::vector<std::unique_ptr<VoxelBlock>> blocks_;
  std::vector<Slot> slots_;  // a power of two, at most half full
};

}  // namespace km
