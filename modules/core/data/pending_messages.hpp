#pragma once

#include <cstddef>
#include <deque>
#include <iterator>
#include <map>
#include <utility>

namespace km {

/// Messages that cannot be processed yet, in one queue per sender. Each queue has a bound, and
/// their total has one. Not thread-safe.
template <typename From, typename Message>
class PendingMessages {
 public:
  struct Bounds {
    std::size_t bytes = 32U << 20U;
    std::size_t bytes_of_one = 8U << 20U;
  };

  PendingMessages() = default;
  explicit PendingMessages(const Bounds& bounds) : bounds_(bounds) {}

  /// Returns false, and drops `message`, if there is no room for its `bytes`. Time in [s], any
  /// origin.
  [[nodiscard]] bool push(const From& from, Message message, std::size_t bytes, double now_s) {
    const auto queue = queues_.find(from);
    const std::size_t bytes_of_one = queue == queues_.end() ? 0 : queue->second.bytes;
    if (bytes_of_one + bytes > bounds_.bytes_of_one || bytes_ + bytes > bounds_.bytes) return false;
    Queue& own = queues_[from];
    own.messages.push_back({std::move(message), bytes, now_s});
    own.bytes += bytes;
    bytes_ += bytes;
    return true;
  }

  /// Offers the oldest message of each queue to `take(from, message, waited_s)`, which returns true
  /// if the message can be removed. Returns the number of removed messages.
  template <typename Take>
  std::size_t serve(double now_s, const Take& take) {
    std::size_t taken = 0;
    for (auto entry = queues_.begin(); entry != queues_.end();) {
      auto& [from, queue] = *entry;
      Waiting& oldest = queue.messages.front();
      if (take(from, oldest.message, now_s - oldest.since_s)) {
        ++taken;
        queue.bytes -= oldest.bytes;
        bytes_ -= oldest.bytes;
        queue.messages.pop_front();
      }
      entry = queue.messages.empty() ? queues_.erase(entry) : std::next(entry);
    }
    return taken;
  }

  [[nodiscard]] bool contains(const From& from) const { return queues_.contains(from); }
  [[nodiscard]] bool empty() const { return queues_.empty(); }

 private:
  struct Waiting {
    Message message;
    std::size_t bytes = 0;
    double since_s = 0.0;
  };
  struct Queue {
    std::deque<Waiting> messages;  // oldest first; never empty
    std::size_t bytes = 0;
  };

  Bounds bounds_;
  std::map<From, Queue> queues_;
  std::size_t bytes_ = 0;
};

}  // namespace km
