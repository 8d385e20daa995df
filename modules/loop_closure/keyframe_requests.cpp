#include "modules/loop_closure/keyframe_requests.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace km {
namespace {

constexpr int kMaxDoublings = 3;
constexpr int kMaxDoublingsIfAbsent = 7;

}  // namespace

KeyframeRequests::KeyframeRequests(double timeout_s, int max_outstanding_per_peer)
    : timeout_s_(timeout_s), max_outstanding_(max_outstanding_per_peer) {
  if (!(timeout_s > 0.0) || max_outstanding_per_peer < 1)
    throw std::invalid_argument("KeyframeRequests: time-out and window must be positive");
}

void KeyframeRequests::want(const KeyframeId& keyframe) {
  Peer& peer = peers_[keyframe.robot];
  if (peer.requests.try_emplace(keyframe.index).second) peer.waiting.push_back(keyframe.index);
}

void KeyframeRequests::ask(Request& request, double now_s) const {
  request.asked = true;
  request.next_s = now_s + timeout_s_ * (1 << std::min(request.attempts, kMaxDoublings));
  ++request.attempts;
}

// The first waiting keyframe that the owner did not have.
std::optional<std::uint32_t> KeyframeRequests::first_absent(const Peer& peer) {
  std::optional<std::uint32_t> first;
  for (const std::uint32_t index : peer.waiting)
    if (peer.requests.at(index).absences > 0 && index <= first.value_or(index)) first = index;
  return first;
}

std::vector<KeyframeId> KeyframeRequests::due(double now_s) {
  std::vector<KeyframeId> now_due;
  for (auto& [robot, peer] : peers_) {
    for (auto& [index, request] : peer.requests) {
      if (!request.asked || request.next_s > now_s) continue;
      ask(request, now_s);
      now_due.push_back({robot, index});
    }
    const std::optional<std::uint32_t> first = first_absent(peer);
    for (auto index = peer.waiting.begin();
         index != peer.waiting.end() && peer.outstanding < max_outstanding_;) {
      Request& request = peer.requests.at(*index);
      if (request.next_s > now_s && !(*index == first && request.absent_s + timeout_s_ <= now_s)) {
        ++index;
        continue;
      }
      ask(request, now_s);
      ++peer.outstanding;
      now_due.push_back({robot, *index});
      index = peer.waiting.erase(index);
    }
  }
  return now_due;
}

bool KeyframeRequests::arrived(const KeyframeId& keyframe) {
  const auto peer = peers_.find(keyframe.robot);
  if (peer == peers_.end()) return false;
  const auto request = peer->second.requests.find(keyframe.index);
  // A late reply may arrive while the keyframe waits for another request.
  if (request == peer->second.requests.end() || request->second.attempts == 0) return false;
  if (request->second.asked) {
    --peer->second.outstanding;
  } else {
    std::erase(peer->second.waiting, keyframe.index);
  }
  peer->second.requests.erase(request);
  return true;
}

void KeyframeRequests::absent(const KeyframeId& keyframe, double now_s) {
  const auto peer = peers_.find(keyframe.robot);
  if (peer == peers_.end()) return;
  const auto found = peer->second.requests.find(keyframe.index);
  if (found == peer->second.requests.end() || !found->second.asked) return;
  Request& request = found->second;
  request.asked = false;
  request.absent_s = now_s;
  request.next_s = now_s + timeout_s_ * (1 << std::min(request.absences++, kMaxDoublingsIfAbsent));
  request.attempts = 1;  // the peer replies, so the time-out need not grow
  --peer->second.outstanding;
  peer->second.waiting.push_back(keyframe.index);
}

void KeyframeRequests::returned(RobotId robot) {
  const auto peer = peers_.find(robot);
  if (peer == peers_.end()) return;
  for (auto& [index, request] : peer->second.requests) {
    request.next_s = std::numeric_limits<double>::lowest();
    request.attempts = std::min(request.attempts, 1);
  }
}

std::size_t KeyframeRequests::size() const {
  std::size_t size = 0;
  for (const auto& [robot, peer] : peers_) size += peer.requests.size();
  return size;
}

}  // namespace km
