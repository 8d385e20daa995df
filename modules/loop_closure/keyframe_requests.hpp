#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/ids.hpp"
#include "modules/loop_closure/word_points.hpp"

namespace km {

/// Part of a keyframe that is requested.
enum class KeyframePart : std::uint8_t {
  kFeatures,     ///< Odometry, keypoints and descriptors: KeyframeReply.
  kWordPoints,   ///< WordPoints: KeyframeWords, or KeyframeReply if no words are known.
  kDescriptors,  ///< As kFeatures, where the requester has the WordPoints.
};

/// Asks the owner of `keyframe` for a part of it. The reply prefers keypoints that keyframe `own`
/// of the requester may also show.
struct KeyframeRequest {
  RobotId requester = 0;
  std::uint32_t number = 0;  ///< Sequence number of the requester.
  KeyframeId keyframe;
  KeyframeIndex own = 0;
  KeyframePart part = KeyframePart::kFeatures;
  std::uint16_t network = 0;  ///< KeyframeFeatures::network of `own`.
};

/// Reply to a KeyframeRequest. `found` is false if the owner does not have the keyframe (yet); only
/// the id of `keyframe` is then set.
struct KeyframeReply {
  std::uint32_t number = 0;  ///< Number of the request.
  bool found = false;
  Keyframe keyframe;
  /// Reply to kDescriptors: descriptors of the WordPoints, in their order. `keyframe` has further
  /// keypoints if these are few. Empty if the owner does not know the words any more: `keyframe`
  /// has all keypoints.
  std::vector<MatchedDescriptor> descriptors = {};
};

/// Reply to a KeyframeRequest for KeyframePart::kWordPoints: those points whose words keyframe
/// KeyframeRequest::own has, too.
struct KeyframeWords {
  std::uint32_t number = 0;  ///< Number of the request.
  KeyframeId keyframe;
  WordPoints words;
};

/// Schedules the requests for keyframes of peers. Every wanted keyframe is requested until it
/// arrives, a few at a time per peer. Requests are repeated after a time-out. Each time without a
/// reply the time-out doubles, up to eightfold, so that an absent peer costs little. If the owner
/// does not have the keyframe (yet), it is requested again later, after other keyframes. Keyframes
/// come into being in order: the first of those that do not exist yet is requested again after each
/// time-out, and the others ever less often. Time is an argument and must not decrease. Not
/// thread-safe.
class KeyframeRequests {
 public:
  /// Throws std::invalid_argument unless both are positive.
  KeyframeRequests(double timeout_s, int max_outstanding_per_peer);

  /// Adds a keyframe of a peer to the wanted keyframes.
  void want(const KeyframeId& keyframe);

  /// Keyframes to request now, for each peer the repeated requests first. The keyframes count as
  /// requested at `now_s`.
  [[nodiscard]] std::vector<KeyframeId> due(double now_s);

  /// Notes that the keyframe has arrived. False if it was not requested.
  [[nodiscard]] bool arrived(const KeyframeId& keyframe);

  /// Notes that the owner of the keyframe does not have it at `now_s`.
  void absent(const KeyframeId& keyframe, double now_s);

  /// Notes that the peer has returned: its unanswered requests are due at once.
  void returned(RobotId robot);

  /// Drops the requests to a peer, because its keyframe indices now mean other keyframes.
  void forget(RobotId robot) { peers_.erase(robot); }

  /// Number of wanted keyframes that have not arrived.
  [[nodiscard]] std::size_t size() const;

 private:
  struct Request {
    bool asked = false;     // sent, and not answered
    int attempts = 0;       // requests without an answer so far
    int absences = 0;       // replies that the owner does not have it
    double absent_s = 0.0;  // time of the last of them
    double next_s = 0.0;    // time before which no (further) request is sent
  };
  struct Peer {
    std::map<std::uint32_t, Request> requests;
    std::deque<std::uint32_t> waiting;  // keyframes whose request has to be sent, oldest first
    int outstanding = 0;
  };

  [[nodiscard]] static std::optional<std::uint32_t> first_absent(const Peer& peer);
  void ask(Request& request, double now_s) const;

  double timeout_s_;
  int max_outstanding_;
  std::map<RobotId, Peer> peers_;
};

/// Keeps the most recently used keyframes, at most `capacity`. Not thread-safe.
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
