#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

namespace km {

/// Numbers of a counted stream that have arrived, in any order: drops duplicates and counts gaps.
/// Memory is bounded: beyond kMaxIntervals separate runs the oldest are joined, and the numbers
/// between them stay missing permanently.
class SequenceTracker {
 public:
  static constexpr std::size_t kMaxIntervals = 1024;

  /// `from_zero`: numbers from 0 on are expected, otherwise from the lowest number that arrives.
  explicit SequenceTracker(bool from_zero) : from_zero_(from_zero) {}

  /// Records `number`. False if it had arrived before.
  [[nodiscard]] bool is_new(std::uint32_t number);

  /// How many numbers below the highest have not arrived (yet).
  [[nodiscard]] std::uint64_t missing() const;

 private:
  bool from_zero_;
  std::uint64_t lost_ = 0;                             // given up in joined runs
  std::map<std::uint64_t, std::uint64_t> end_of_run_;  // begin -> end, half open, disjoint
};

}  // namespace km
