#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "modules/core/keyframe.hpp"
#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

/// A peer's keyframe whose search can begin.
struct PeerQuery {
  std::uint32_t index = 0;
  std::shared_ptr<const BowVector> vector;
  std::shared_ptr<const BowVector> previous;  ///< Vector of the keyframe that normalises the score;
                                              ///< null if there is none.
  ImageDescriptor image = {};
};

/// Finds the normaliser of each keyframe of one peer.
///
/// The keyframe before a query normalises it, but messages arrive in any order, and a peer that was
/// out of reach delivers its history in a burst. A keyframe whose predecessor is missing waits
/// until `max_waiting` further keyframes have arrived. Then the nearest earlier keyframe replaces
/// the predecessor. Keyframe 0 has no normaliser, nor has a keyframe without an earlier keyframe at
/// the end of its wait, nor one after a gap that has been removed. A keyframe without words shows a
/// known place: it is no query, and the keyframe before it normalises the one after it. Memory
/// holds the vectors that may still be needed: of the waiting keyframes, of the newest keyframe,
/// and of the keyframe before each of the kMaxGaps newest gaps. It also holds the descriptors of
/// the waiting keyframes' images.
class PeerHistory {
 public:
  static constexpr std::size_t kMaxGaps = 1000;

  explicit PeerHistory(std::size_t max_waiting) : max_waiting_(max_waiting) {}

  /// Adds keyframe `index`, unless it has been added before. Returns the queries that became
  /// possible, by ascending index. Each keyframe is returned once.
  std::vector<PeerQuery> add(std::uint32_t index, BowVector vector, ImageDescriptor image = {});

  /// True if keyframe `index` has been added.
  bool has(std::uint32_t index) const { return keyframes_.contains(index); }

  /// Number of keyframes that wait for their predecessor.
  std::size_t waiting() const { return waiting_.size(); }

 private:
  using Vector = std::shared_ptr<const BowVector>;
  using Keyframes = std::map<std::uint32_t, Vector>;
  struct Waiting {
    std::size_t deadline = 0;  // the size of keyframes_ at which the wait ends
    ImageDescriptor image;
  };
  PeerQuery release(Keyframes::iterator keyframe);
  void forget_if_done(Keyframes::iterator keyframe);
  void forget_oldest_gaps();
  bool is_empty(Keyframes::const_iterator keyframe) const {
    return keyframe->second != nullptr && keyframe->second->words.empty();
  }
  bool follows_its_predecessor(Keyframes::const_iterator keyframe) const;

  std::size_t max_waiting_;
  Keyframes keyframes_;           // null once the keyframe and its successor are released
  std::set<std::uint32_t> kept_;  // indices of the keyframes_ that are not null
  std::map<std::uint32_t, Waiting> waiting_;
};

}  // namespace km
