#include "modules/place_recognition/peer_history.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace km {

std::vector<PeerQuery> PeerHistory::add(std::uint32_t index, BowVector vector,
                                        ImageDescriptor image) {
  std::vector<PeerQuery> released;
  const auto [added, is_new] = keyframes_.try_emplace(index, nullptr);
  if (!is_new) return released;
  added->second = std::make_shared<const BowVector>(std::move(vector));
  kept_.insert(index);
  waiting_[index] = {keyframes_.size() + max_waiting_, std::move(image)};

  for (auto waiting = waiting_.begin(); waiting != waiting_.end();) {
    const auto keyframe = keyframes_.find(waiting->first);
    const bool overdue = keyframes_.size() >= waiting->second.deadline && waiting->first != index;
    if (!overdue && !follows_its_predecessor(keyframe)) {
      ++waiting;
      continue;
    }
    ImageDescriptor described = std::move(waiting->second.image);
    waiting = waiting_.erase(waiting);
    const bool has_words = !is_empty(keyframe);
    PeerQuery query = release(keyframe);
    query.image = std::move(described);
    if (has_words) released.push_back(std::move(query));
  }
  forget_oldest_gaps();
  return released;
}

bool PeerHistory::follows_its_predecessor(Keyframes::const_iterator keyframe) const {
  if (keyframe->first == 0) return true;  // nothing to wait for
  if (keyframe == keyframes_.begin()) return false;
  const auto before = std::prev(keyframe);
  const bool has_normalizer = !is_empty(before) || !waiting_.contains(before->first);
  return before->first + 1 == keyframe->first && has_normalizer;
}

PeerQuery PeerHistory::release(Keyframes::iterator keyframe) {
  PeerQuery query{keyframe->first, keyframe->second, nullptr, {}};
  if (keyframe != keyframes_.begin()) {
    // The nearest earlier keyframe still has its vector, unless there are too many gaps, because
    // only its successor releases the vector.
    const auto before = std::prev(keyframe);
    query.previous = before->second;
    if (is_empty(keyframe)) keyframe->second = before->second;
    forget_if_done(before);
  }
  forget_if_done(keyframe);
  return query;
}

void PeerHistory::forget_if_done(Keyframes::iterator keyframe) {
  const auto after = std::next(keyframe);
  const bool successor_is_known = after != keyframes_.end() && follows_its_predecessor(after);
  if (!successor_is_known || waiting_.contains(keyframe->first) || waiting_.contains(after->first))
    return;
  keyframe->second.reset();
  kept_.erase(keyframe->first);
}

// Deletes the vectors of the keyframes before the oldest gaps, so that at most kMaxGaps remain.
// Waiting keyframes keep their vectors. Their number is bounded.
void PeerHistory::forget_oldest_gaps() {
  for (auto oldest = kept_.begin();
       kept_.size() > kMaxGaps + waiting_.size() && oldest != kept_.end();) {
    if (waiting_.contains(*oldest)) {
      ++oldest;
      continue;
    }
    keyframes_.at(*oldest).reset();
    oldest = kept_.erase(oldest);
  }
}

}  // namespace km
