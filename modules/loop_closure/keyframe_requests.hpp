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

/// Asks the owner of `keyframe` for its odometry, points and descriptors, of which those come that
/// keyframe `own` of the requester may show, too.
struct KeyframeRequest {
  RobotId requester = 0;
  std::uint32_t number = 0;  ///< Counts the requester's requests.
  KeyframeId keyframe;
  KeyframeIndex own = 0;
};

/// The answer. `found` is false where the owner has no such keyframe (yet): then only the
/// keyframe's id is set.
struct KeyframeReply {
  std::uint32_t number = 0;  ///< Of the request.
  bool found = false;
  Keyframe keyframe;
};

/// When to ask which peer for which keyframe. Every keyframe wanted is asked for until it arrives:
/// a few at a time per peer, again after a time-out that doubles up to eightfold while there is no
/// answer, so that a peer that vanished costs little and is served soon after it returns. A
/// keyframe its owner does not have (yet) makes room for the others and is asked for again later.
/// Time comes from outside and must not go backwards. Not thread-safe.
class KeyframeRequests {
 public:
  /// Throws std::invalid_argument unless both are positive.
  KeyframeRequests(double timeout_s, int max_outstanding_per_peer);

  /// Adds a keyframe of a peer; nothing if it is wanted already.
  void want(const KeyframeId& keyframe);

  /// Keyframes to ask for now, repeated ones first. They count as asked at `now_s`.
  [[nodiscard]] std::vector<KeyframeId> due(double now_s);

  /// The keyframe has come. False if it was not asked for.
  [[nodiscard]] bool arrived(const KeyframeId& keyframe);

  /// Its owner does not have it at `now_s`.
  void absent(const KeyframeId& keyframe, double now_s);

  /// The peer is there (again): what it has not answered is due at once.
  void returned(RobotId robot);

  /// The peer's keyframes are others now: none of them is wanted.
  void forget(RobotId robot) { peers_.erase(robot); }

  /// Keyframes that have not come.
  [[nodiscard]] std::size_t size() const;

 private:
  struct Request {
    bool asked = false;   // under way
    int attempts = 0;     // without an answer
    double next_s = 0.0;  // not asked (again) before
  };
  struct Peer {
    std::map<std::uint32_t, Request> requests;
    std::deque<std::uint32_t> waiting;  // not under way, oldest first
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

  /// Null if it is not (or no longer) there.
  std::shared_ptr<const Keyframe> get(const KeyframeId& id) {
    const auto found = place_.find(id);
    if (found == place_.end()) return nullptr;
    by_use_.splice(by_use_.begin(), by_use_, found->second);
    return by_use_.front();
  }

  /// Drops those of a robot.
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
