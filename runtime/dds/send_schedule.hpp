#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <list>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/ids.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/traffic.hpp"
#include "runtime/token_bucket.hpp"

namespace km {

/// Order of sending when the budget is short, most important first.
enum class SendPriority {
  kPresence,      ///< Statuses: small, and always sent.
  kClosures,      ///< Closures: sent once, and needed to join robots.
  kVerification,  ///< Requests for keyframes, and replies.
  kPoses,         ///< All messages of the pose graph.
  kWords,         ///< Bags of words.
  kBacklog,       ///< Bags of words that are not new any more.
  kMesh           ///< Chunks of the mesh, and all other messages.
};
inline constexpr std::size_t kSendPriorities = 7;

/// Priority of a topic, never kBacklog. A topic of geometric verification has the priority
/// kClosures if its kind is kEvent, otherwise kVerification.
[[nodiscard]] constexpr SendPriority priority_of(TopicKind kind, TrafficCategory category) {
  if (kind == TopicKind::kStatus) return SendPriority::kPresence;
  switch (category) {
    case TrafficCategory::kPlaceRecognition:
      return SendPriority::kWords;
    case TrafficCategory::kGeometricVerification:
      return kind == TopicKind::kEvent ? SendPriority::kClosures : SendPriority::kVerification;
    case TrafficCategory::kPoseGraphOptimization:
      return SendPriority::kPoses;
    case TrafficCategory::kMap:
    case TrafficCategory::kOther:
      break;
  }
  return SendPriority::kMesh;
}

/// Messages of each priority are sent while all sent bytes are below this share of
/// budget.bytes_per_run.
inline constexpr std::array<double, kSendPriorities> kShareOfRun = {1.0, 1.0, 0.9, 0.95,
                                                                    0.8, 0.8, 0.6};

/// Messages to be sent, the most important first, each as soon as the budget permits it. Messages
/// of one priority keep their order, except for bags of words: those that have waited for kNew_s
/// follow newer ones.
///
/// A message is sent if there is no debt, however large it is: the next ones wait until the debt is
/// paid. So in any time of t seconds at most bytes_per_s * (t + kBurst_s) and one message are sent.
///
/// With a budget no sender waits for room: each priority has a bound, beyond which the oldest
/// messages are dropped. Requests that are too old to be answered are dropped, too. For a state,
/// only the newest message with its key is kept. Without a budget all messages are sent in order,
/// and none is dropped or replaced.
///
/// Deterministic: time comes in [s], with any origin, and does not decrease. Not thread-safe.
template <typename TopicId, typename Message>
class SendSchedule {
 public:
  static constexpr std::size_t kMaxMessages = 8192;       ///< Waiting messages of one priority.
  static constexpr std::uint64_t kMaxBytes = 32U << 20U;  ///< Waiting bytes of one priority.
  static constexpr double kNew_s = 5.0;                   ///< Age up to which a bag of words is
                                                          ///< new.

  /// Amount that may be sent at once after a silence, in seconds of the limit.
  static constexpr double kBurst_s = 0.2;

  struct Entry {
    TopicId topic = {};
    SendPriority priority = SendPriority::kMesh;
    bool newest_wins = false;        ///< Replaces a message with equal topic, `to` and `key`.
    std::optional<RobotId> to = {};  ///< Empty: all.
    std::uint64_t key = 0;
    std::uint64_t bytes = 0;                                    ///< Size as sent to one reader.
    double useful_s = std::numeric_limits<double>::infinity();  ///< Maximum age [s].
    Message message = {};
  };

  /// Throws ConfigError if `config` is out of bounds.
  explicit SendSchedule(const BudgetConfig& config)
      : budget_(checked(config)), limited_(config.is_limited()) {
    // The bucket begins empty, so that the limit also holds in the first second of a run.
    if (config.bytes_per_s > 0.0)
      bucket_.emplace(config.bytes_per_s, kBurst_s * config.bytes_per_s, 0.0);
  }

  void push(Entry entry, double now_s) {
    Lane& lane = lane_of(entry.priority);
    if (limited_ && entry.newest_wins && replace(entry)) return;
    lane.messages.push_back({std::move(entry), now_s, lane.stops, lane.priority});
    const Entry& last = lane.messages.back().entry;
    lane.bytes += last.bytes;
    ++size_;
    if (!limited_) return;
    held_[last.topic].waiting.add(last.bytes);
    if (last.newest_wins) newest_[name_of(last)] = std::prev(lane.messages.end());
    drop_surplus(lane);
  }

  /// The next message that may be sent. `readers_of(entry)` returns its receivers, or nullopt while
  /// the message should wait for a receiver. It is not called without a budget.
  template <typename ReadersOf>
  [[nodiscard]] std::optional<Entry> pop(double now_s, const ReadersOf& readers_of) {
    wait_s_.reset();
    move_to_backlog(now_s);
    for (Lane& lane : lanes_)
      if (may_go(lane, now_s, readers_of)) return std::move(take_front(lane).entry);
    return std::nullopt;
  }

  /// After a pop() without a result: time until the budget permits a message; nullopt if no message
  /// waits for the budget.
  [[nodiscard]] std::optional<double> wait_s() const { return wait_s_; }

  /// Updates the sum of all sent bytes, which is counted elsewhere: bytes that DDS has sent by
  /// itself, or again, are charged now.
  void settle(std::uint64_t sent_bytes, double now_s) {
    if (sent_bytes > spent_bytes_) charge(sent_bytes - spent_bytes_, now_s);
  }

  /// Drops all waiting messages at the end.
  void drop_all() {
    for (Lane& lane : lanes_)
      while (!lane.messages.empty()) drop_front(lane);
  }

  /// Counts by topic; topics without held-back messages may be absent.
  [[nodiscard]] const std::map<TopicId, HeldBack>& held_back() const { return held_; }

  [[nodiscard]] bool is_limited() const { return limited_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  struct Waiting {
    Entry entry;
    double since_s = 0.0;
    std::uint64_t stops = 0;                  // Lane::stops at the arrival of the message
    SendPriority lane = SendPriority::kMesh;  // lane in which it waits
  };
  struct Lane {
    SendPriority priority = SendPriority::kPresence;
    std::list<Waiting> messages = {};
    std::uint64_t bytes = 0;
    std::uint64_t stops = 0;  // number of times the budget has stopped this lane
  };
  using Place = typename std::list<Waiting>::iterator;
  using Name = std::tuple<TopicId, std::optional<RobotId>, std::uint64_t>;

  static std::array<Lane, kSendPriorities> make_lanes() {
    std::array<Lane, kSendPriorities> lanes;
    for (std::size_t k = 0; k < lanes.size(); ++k) lanes[k].priority = static_cast<SendPriority>(k);
    return lanes;
  }
  [[nodiscard]] Lane& lane_of(SendPriority priority) {
    return lanes_[static_cast<std::size_t>(priority)];
  }
  [[nodiscard]] static Name name_of(const Entry& entry) {
    return {entry.topic, entry.to, entry.key};
  }

  // The new message takes the place of the replaced one, so that a state that changes often is also
  // sent.
  bool replace(Entry& entry) {
    const auto found = newest_.find(name_of(entry));
    if (found == newest_.end()) return false;
    Entry& before = found->second->entry;
    HeldBack& held = held_[entry.topic];
    held.superseded.add(before.bytes);
    held.waiting.bytes += entry.bytes - before.bytes;
    lane_of(found->second->lane).bytes += entry.bytes - before.bytes;
    before = std::move(entry);
    return true;
  }

  void move_to_backlog(double now_s) {
    if (!limited_) return;
    Lane& words = lane_of(SendPriority::kWords);
    Lane& backlog = lane_of(SendPriority::kBacklog);
    while (!words.messages.empty() && now_s - words.messages.front().since_s >= kNew_s) {
      Waiting& front = words.messages.front();
      front.stops = front.stops == words.stops ? backlog.stops : kHeld;
      front.lane = backlog.priority;
      words.bytes -= front.entry.bytes;
      backlog.bytes += front.entry.bytes;
      backlog.messages.splice(backlog.messages.end(), words.messages, words.messages.begin());
    }
    drop_surplus(backlog);
  }

  // True if the first message of a lane may be sent. Drops messages that may never be sent.
  template <typename ReadersOf>
  bool may_go(Lane& lane, double now_s, const ReadersOf& readers_of) {
    while (!lane.messages.empty()) {
      if (!limited_) return true;
      const Waiting& first = lane.messages.front();
      const std::optional<std::vector<RobotId>> readers = readers_of(first.entry);
      if (!readers) return false;
      const std::uint64_t bytes = first.entry.bytes * readers->size();
      const auto wait = wait_s(lane.priority, bytes, now_s);
      if (wait && now_s - first.since_s <= first.entry.useful_s) {
        if (*wait <= 0.0) {
          charge(bytes, now_s);
          return true;
        }
        ++lane.stops;
        wait_s_ = std::min(wait_s_.value_or(*wait), *wait);
        return false;
      }
      drop_front(lane);
    }
    return false;
  }

  // Time until a message may be sent. nullopt: never, because its priority has used up its share of
  // the run's total.
  std::optional<double> wait_s(SendPriority priority, std::uint64_t bytes, double now_s) {
    // A slightly negative balance counts as no debt, because sums of doubles do not reach zero.
    constexpr double kNoDebt_bytes = -1e-3;
    if (priority == SendPriority::kPresence) return 0.0;
    const auto total = static_cast<double>(spent_bytes_ + bytes);
    if (budget_.bytes_per_run > 0.0 &&
        total > kShareOfRun[static_cast<std::size_t>(priority)] * budget_.bytes_per_run)
      return std::nullopt;
    return bucket_ ? bucket_->wait_s(kNoDebt_bytes, now_s) : 0.0;
  }

  void charge(std::uint64_t bytes, double now_s) {
    spent_bytes_ += bytes;
    if (bucket_) bucket_->spend(static_cast<double>(bytes), now_s);
  }

  void drop_surplus(Lane& lane) {
    while (lane.messages.size() > kMaxMessages ||
           (lane.bytes > kMaxBytes && lane.messages.size() > 1))
      drop_front(lane);
  }

  void drop_front(Lane& lane) {
    const Entry dropped = take_out(lane).entry;
    held_[dropped.topic].dropped.add(dropped.bytes);
  }

  Waiting take_front(Lane& lane) {
    const bool held = limited_ && lane.messages.front().stops != lane.stops;
    Waiting front = take_out(lane);
    if (held) held_[front.entry.topic].delayed.add(front.entry.bytes);
    return front;
  }

  Waiting take_out(Lane& lane) {
    Waiting front = std::move(lane.messages.front());
    if (front.entry.newest_wins) newest_.erase(name_of(front.entry));
    lane.messages.pop_front();
    lane.bytes -= front.entry.bytes;
    --size_;
    if (!limited_) return front;
    TrafficCount& waiting = held_[front.entry.topic].waiting;
    --waiting.messages;
    waiting.bytes -= front.entry.bytes;
    return front;
  }

  static constexpr std::uint64_t kHeld = std::numeric_limits<std::uint64_t>::max();

  const BudgetConfig budget_;
  const bool limited_;
  std::optional<TokenBucket> bucket_;
  std::uint64_t spent_bytes_ = 0;
  std::array<Lane, kSendPriorities> lanes_ = make_lanes();
  std::map<Name, Place> newest_;
  std::map<TopicId, HeldBack> held_;
  std::optional<double> wait_s_;
  std::size_t size_ = 0;
};

}  // namespace km
