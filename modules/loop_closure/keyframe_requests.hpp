#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

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

}  // namespace km
