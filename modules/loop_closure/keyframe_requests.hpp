#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/keyframe.hpp"

namespace km {

/// Asks the owner of `keyframe` for its odometry, points and descriptors. The reply prefers points
/// that keyframe `own` of the requester may also show.
struct KeyframeRequest {
  RobotId requester = 0;
  std::uint32_t number = 0;  ///< Counts the requester's requests.
  KeyframeId keyframe;
  KeyframeIndex own = 0;
};

/// The reply. `found` is false if the owner does not have the keyframe (yet): then only the
/// keyframe's id is set.
struct KeyframeReply {
  std::uint32_t number = 0;  ///< Number of the request.
  bool found = false;
  Keyframe keyframe;
};

/// Schedules the requests for keyframes of peers. Every wanted keyframe is requested until it
/// arrives, a few at a time per peer. Requests are repeated after a time-out that doubles up to
/// eightfold without a reply. So a vanished peer costs little and is served soon after it returns.
/// A keyframe that its owner does not have (yet) is requested again later, after others. Time is an
/// argument and must not decrease. Not thread-safe.
class KeyframeRequests {
 public:
  /// Throws std::invalid_argument unless both are positive.
  KeyframeRequests(double timeout_s, int max_outstanding_per_peer);

  /// Adds a keyframe of a peer, unless it is wanted already.
  void want(const KeyframeId& keyframe);

  /// Keyframes to request now, repeated ones first. They count as requested at `now_s`.
  [[nodiscard]] std::vector<KeyframeId> due(double now_s);

  /// Notes that the keyframe has arrived. False if it was not requested.
  [[nodiscard]] bool arrived(const KeyframeId& keyframe);

  /// Notes that the owner of the keyframe does not have it at `now_s`.
  void absent(const KeyframeId& keyframe, double now_s);

  /// Notes that the peer has returned: its unanswered requests are due at once.
  void returned(RobotId robot);

  /// Drops the requests to a peer, because its keyframe indices now mean other keyframes.
  void forget(RobotId robot) { peers_.erase(robot); }

  /// Number of keyframes that have not arrived.
  [[nodiscard]] std::size_t size() const;

 private:
  struct Request {
    bool asked = false;   // under way
    int attempts = 0;     // requests without an answer so far
    double next_s = 0.0;  // time before which no (further) request is sent
  };
  struct Peer {
    std::map<std::uint32_t, Request> requests;
    std::deque<std::uint32_t> waiting;  // keyframes whose request is not sent yet, oldest first
    int outstanding = 0;
  };

  void ask(Request& request, double now_s) const;

  double timeout_s_;
  int max_outstanding_;
  std::map<RobotId, Peer> peers_;
};

/// Keeps the keyframes used last, at most `capacity`. Not thread-safe.
class KeyframeCache {
 public:
  explicit KeyframeCache(std::size_t capacity) : capacity_(capacity) {}

  void put(std::shared_ptr<const Keyframe> keyframe) {
    const KeyframeId id = keyframe->odometry.id;
    if (const auto old = place_.find(id); old != place_.end()) by_use_.erase(old->second);
    by_use_.push_front(std::move(keyframe));
    place_[id] = by_use_.begin();
    if (by_use_.size() <= capacity_) return;
    place_.erase(by_use_.back()->odometry.id);
    by_use_.pop_back();
  }

  /// Null if the keyframe is not (or no longer) stored.
  std::shared_ptr<const Keyframe> get(const KeyframeId& id) {
    const auto found = place_.find(id);
    if (found == place_.end()) return nullptr;
    by_use_.splice(by_use_.begin(), by_use_, found->second);
    return by_use_.front();
  }

  /// Drops the keyframes of a robot.
  void forget(RobotId robot) {
    std::erase_if(by_use_, [&](const auto& kept) { return kept->odometry.id.robot == robot; });
    std::erase_if(place_, [&](const auto& entry) { return entry.first.robot == robot; });
  }

 private:
  using ByUse = std::list<std::shared_ptr<const Keyframe>>;

  std::size_t capacity_;
  ByUse by_use_;  // latest first
  std::map<KeyframeId, ByUse::iterator> place_;
};

}  // namespace km
