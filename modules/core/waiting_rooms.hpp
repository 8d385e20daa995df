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
class WaitingRooms {
 public:
  struct Bounds {
    std::size_t bytes = 32U << 20U;
    std::size_t bytes_of_one = 8U << 20U;
  };

  WaitingRooms() = default;
  explicit WaitingRooms(const Bounds& bounds) : bounds_(bounds) {}

  /// Returns false, and drops `message`, if there is no room for its `bytes`. Time in [s], any
  /// origin.
  [[nodiscard]] bool push(const From& from, Message message, std::size_t bytes, double now_s) {
    const auto room = rooms_.find(from);
    const std::size_t bytes_of_one = room == rooms_.end() ? 0 : room->second.bytes;
    if (bytes_of_one + bytes > bounds_.bytes_of_one || bytes_ + bytes > bounds_.bytes) return false;
    Room& own = rooms_[from];
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
    for (auto entry = rooms_.begin(); entry != rooms_.end();) {
      auto& [from, room] = *entry;
      Waiting& oldest = room.messages.front();
      if (take(from, oldest.message, now_s - oldest.since_s)) {
        ++taken;
        room.bytes -= oldest.bytes;
        bytes_ -= oldest.bytes;
        room.messages.pop_front();
      }
      entry = room.messages.empty() ? rooms_.erase(entry) : std::next(entry);
    }
    return taken;
  }

  [[nodiscard]] bool contains(const From& from) const { return rooms_.contains(from); }
  [[nodiscard]] bool empty() const { return rooms_.empty(); }

 private:
  struct Waiting {
    Message message;
    std::size_t bytes = 0;
    double since_s = 0.0;
  };
  struct Room {
    std::deque<Waiting> messages;  // oldest first; never empty
    std::size_t bytes = 0;
  };

  Bounds bounds_;
  std::map<From, Room> rooms_;
  std::size_t bytes_ = 0;
};

}  // namespace km
