#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "runtime/topic.hpp"
#include "test/support/patience.hpp"

namespace km {

/// Collects the messages of a topic; a caller may wait for them.
template <typename T>
class Inbox {
 public:
  explicit Inbox(In<T> topic) {
    topic.subscribe([this](const std::shared_ptr<const T>& message) {
      const std::lock_guard lock(mutex_);
      messages_.push_back(*message);
      changed_.notify_all();
    });
  }

  /// Waits until there are `count` messages; all there are by then.
  std::vector<T> wait_for(std::size_t count) {
    return wait_until([count](const std::vector<T>& messages) { return messages.size() >= count; });
  }
  std::vector<T> wait_until(const std::function<bool(const std::vector<T>&)>& enough) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kPatience, [&] { return enough(messages_); });
    return messages_;
  }
  std::vector<T> messages() {
    const std::lock_guard lock(mutex_);
    return messages_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<T> messages_;
};

}  // namespace km
