#pragma once

#include <memory>
#include <mutex>
#include <utility>

namespace km {

/// The newest message of a kind, until it is taken. For large messages of which only the newest
/// counts: in the queue of a slow node they would accumulate in memory. Thread-safe.
template <typename T>
class Latest {
 public:
  using Message = std::shared_ptr<const T>;

  /// Replaces a value that has not been taken. Does nothing after close().
  void put(Message message) {
    const std::lock_guard lock(mutex_);
    if (!closed_) message_.swap(message);
  }

  /// Null if there was no put() since the last take().
  [[nodiscard]] Message take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(message_, nullptr);
  }

  /// Closes the channel; the last value can still be taken.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }

 private:
  std::mutex mutex_;
  Message message_;
  bool closed_ = false;
};

}  // namespace km
