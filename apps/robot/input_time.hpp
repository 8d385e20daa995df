#pragma once

#include <algorithm>
#include <mutex>
#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// Progress of a robot in its input: time from the first stamp to the latest. Thread-safe.
class InputTime {
 public:
  void reach(Stamp stamp) {
    const std::lock_guard lock(mutex_);
    if (!first_) first_ = last_ = stamp;
    last_ = std::max(last_, stamp);
  }

  /// [s]; 0 before the first stamp.
  [[nodiscard]] double seconds() const {
    const std::lock_guard lock(mutex_);
    return first_ ? seconds_between(*first_, last_) : 0.0;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<Stamp> first_;
  Stamp last_ = 0;
};

}  // namespace km
