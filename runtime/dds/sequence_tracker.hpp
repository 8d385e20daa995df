#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

namespace km {

/// Numbers of a counted stream that have arrived, in any order: detects duplicates. Memory is
/// bounded: beyond kMaxIntervals separate runs the oldest are joined, and the numbers between them
/// count as arrived.
class SequenceTracker {
 public:
  static constexpr std::size_t kMaxIntervals = 1024;

  /// Records `number`. False if it had arrived before.
  [[nodiscard]] bool is_new(std::uint32_t number);

 private:
  std::map<std::uint64_t, std::uint64_t> end_of_run_;  // begin -> end, half open, disjoint
};

}  // namespace km
