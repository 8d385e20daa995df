#include "runtime/dds/sequence_tracker.hpp"

#include <iterator>

namespace km {

bool SequenceTracker::is_new(std::uint32_t number) {
  const std::uint64_t begin = number;
  std::uint64_t end = begin + 1;
  auto next = end_of_run_.upper_bound(begin);
  const bool has_previous = next != end_of_run_.begin();
  const auto previous = has_previous ? std::prev(next) : end_of_run_.end();
  if (has_previous && previous->second > begin) return false;

  if (next != end_of_run_.end() && next->first == end) {
    end = next->second;
    next = end_of_run_.erase(next);
  }
  if (has_previous && previous->second == begin) {
    previous->second = end;
  } else {
    end_of_run_.emplace_hint(next, begin, end);
  }

  if (end_of_run_.size() > kMaxIntervals) {
    const auto first = end_of_run_.begin();
    const auto second = std::next(first);
    first->second = second->second;
    end_of_run_.erase(second);
  }
  return true;
}

}  // namespace km
