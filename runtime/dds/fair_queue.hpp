#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "modules/core/ids.hpp"

namespace km {

/// What one peer may have waiting on one topic, and how fast it is served.
struct QueueQuota {
  std::size_t messages = 20000;
  std::size_t bytes = 8U << 20U;
  bool newest_wins = false;  ///< Full: the oldest makes room; else the newest is not taken.
  double per_second = std::numeric_limits<double>::infinity();
  double burst = 1.0;  ///< Served at once after a silence; with a finite per_second.
};

/// Queues of messages, one per peer, served in turn: a peer that sends much waits for itself and
/// not the others. Time comes in [s], any origin, and does not go backwards. Not thread-safe.
template <typename Message>
class FairQueue {
 public:
  explicit FairQueue(QueueQuota quota) : quota_(quota) {}

  /// False if `peer` has no room: one message was dropped, this one or its oldest.
  bool push(RobotId peer, Message message, std::size_t bytes, double now_s) {
    const auto [entry, fresh] = peers_.try_emplace(peer);
    Line& line = entry->second;
    if (fresh) {
      line.tokens = quota_.burst;
      line.counted_s = now_s;
    }
    bool fits = has_room(line, bytes);
    const bool all_fit = fits;
    while (!fits && quota_.newest_wins && !line.waiting.empty()) {
      take_front(line);
      fits = has_room(line, bytes);
    }
    if (!fits) return false;
    line.bytes += bytes;
    line.waiting.push_back({std::move(message), bytes});
    ++size_;
    return all_fit;
  }

  /// The next message of the next peer that may be served.
  std::optional<Message> pop(double now_s) {
    auto turn = peers_.upper_bound(last_);
    for (std::size_t k = 0; k < peers_.size(); ++k, ++turn) {
      if (turn == peers_.end()) turn = peers_.begin();
      Line& line = turn->second;
      if (line.waiting.empty() || !may_serve(line, now_s)) continue;
      last_ = turn->first;
      return take_front(line);
    }
    return std::nullopt;
  }

  /// How long after `now_s` pop() will give something if nothing is pushed; nullopt: never.
  [[nodiscard]] std::optional<double> wait_s(double now_s) {
    std::optional<double> least;
    for (auto& [peer, line] : peers_) {
      if (line.waiting.empty()) continue;
      const double wait =
          may_serve_now(line, now_s) ? 0.0 : (1.0 - line.tokens) / quota_.per_second;
      least = std::min(least.value_or(wait), wait);
    }
    return least;
  }

  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  struct Waiting {
    Message message;
    std::size_t bytes = 0;
  };
  struct Line {
    std::deque<Waiting> waiting;
    std::size_t bytes = 0;
    double tokens = 0.0;  // at counted_s
    double counted_s = 0.0;
  };

  [[nodiscard]] bool has_room(const Line& line, std::size_t bytes) const {
    return line.waiting.size() < quota_.messages && line.bytes + bytes <= quota_.bytes;
  }

  bool may_serve_now(Line& line, double now_s) {
    if (quota_.per_second == std::numeric_limits<double>::infinity()) return true;
    line.tokens =
        std::min(quota_.burst, line.tokens + quota_.per_second * (now_s - line.counted_s));
    line.counted_s = now_s;
    return line.tokens >= 1.0;
  }

  bool may_serve(Line& line, double now_s) {
    if (!may_serve_now(line, now_s)) return false;
    line.tokens -= 1.0;
    return true;
  }

  Message take_front(Line& line) {
    Waiting front = std::move(line.waiting.front());
    line.waiting.pop_front();
    line.bytes -= front.bytes;
    --size_;
    return std::move(front.message);
  }

  QueueQuota quota_;
  std::map<RobotId, Line> peers_;
  RobotId last_ = 0;  // served
  std::size_t size_ = 0;
};

}  // namespace km
