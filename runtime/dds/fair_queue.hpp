#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "modules/core/ids.hpp"
#include "runtime/token_bucket.hpp"

namespace km {

/// Bound on the waiting messages of one peer on one topic, and the rate at which they are
/// processed.
struct QueueQuota {
  std::size_t messages = 20000;
  std::size_t bytes = 8U << 20U;
  bool newest_wins = false;  ///< When the queue is full, drop the oldest message; otherwise refuse
                             ///< the newest.
  double per_second = std::numeric_limits<double>::infinity();
  double burst = 1.0;  ///< Number of messages served at once after a silence; with a finite
                       ///< per_second.
};

/// Queues of messages, one per peer, served in rotation: a peer that sends much delays only its own
/// messages. Time comes in [s], with any origin, and does not decrease. Not thread-safe.
template <typename Message>
class FairQueue {
 public:
  explicit FairQueue(QueueQuota quota) : quota_(quota) {}

  /// False if the queue of `peer` is full. Then this message, or the oldest ones, are dropped.
  bool push(RobotId peer, Message message, std::size_t bytes, double now_s) {
    Line& line = peers_.try_emplace(peer, quota_, now_s).first->second;
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
      if (line.waiting.empty() || line.tokens.wait_s(1.0, now_s) > 0.0) continue;
      line.tokens.spend(1.0, now_s);
      last_ = turn->first;
      return take_front(line);
    }
    return std::nullopt;
  }

  /// Time after `now_s` until pop() returns a message if nothing is pushed; nullopt: never.
  [[nodiscard]] std::optional<double> wait_s(double now_s) {
    std::optional<double> least;
    for (auto& [peer, line] : peers_) {
      if (line.waiting.empty()) continue;
      const double wait = line.tokens.wait_s(1.0, now_s);
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
    Line(const QueueQuota& quota, double now_s)
        : tokens(quota.per_second, quota.burst, quota.burst) {
      tokens.spend(0.0, now_s);  // tokens accumulate from now on
    }

    std::deque<Waiting> waiting;
    std::size_t bytes = 0;
    TokenBucket tokens;  // one token is spent per message
  };

  [[nodiscard]] bool has_room(const Line& line, std::size_t bytes) const {
    return line.waiting.size() < quota_.messages && line.bytes + bytes <= quota_.bytes;
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
  RobotId last_ = 0;  // peer that was served last
  std::size_t size_ = 0;
};

}  // namespace km
