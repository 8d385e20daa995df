#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

/// A peer's keyframe that can be searched for now.
struct PeerQuery {
  std::uint32_t index = 0;
  std::shared_ptr<const BowVector> vector;
  std::shared_ptr<const BowVector> previous;  ///< Vector of the keyframe before it, which
                                              ///< normalises the score; null if there is none.
};

/// The keyframes of one peer in a form for searching.
///
/// A query is normalised by the keyframe before it, but messages arrive in any order, and a peer
/// that was out of reach delivers its history in a burst. A keyframe whose predecessor is missing
/// waits for it until `max_waiting` further keyframes have arrived. Then the nearest earlier
/// keyframe replaces the predecessor. Some keyframes have no normaliser: keyframe 0, one without
/// any earlier keyframe by then, and one in a gap that has been removed. Memory holds the vectors
/// that may still be needed: one for each of the kMaxGaps newest gaps, and the newest.
class PeerHistory {
 public:
  static constexpr std::size_t kMaxGaps = 1000;

  explicit PeerHistory(std::size_t max_waiting) : max_waiting_(max_waiting) {}

  /// Adds keyframe `index`. Returns the queries that became possible, by ascending index. Each
  /// keyframe is returned once; a repeated one is ignored, see has().
  std::vector<PeerQuery> add(std::uint32_t index, BowVector vector);

  /// True if keyframe `index` has been added.
  bool has(std::uint32_t index) const { return keyframes_.contains(index); }

  /// Keyframes that wait for their predecessor.
  std::size_t waiting() const { return deadlines_.size(); }

 private:
  using Vector = std::shared_ptr<const BowVector>;
  using Keyframes = std::map<std::uint32_t, Vector>;
  PeerQuery release(Keyframes::iterator keyframe);
  void forget_if_done(Keyframes::iterator keyframe);
  void forget_oldest_gaps();
  bool follows_its_predecessor(Keyframes::const_iterator keyframe) const;

  std::size_t max_waiting_;
  Keyframes keyframes_;                             // null once it and its successor are released
  std::set<std::uint32_t> kept_;                    // entries of keyframes_ that are not null
  std::map<std::uint32_t, std::size_t> deadlines_;  // deadlines of waiting keyframes, in
                                                    // keyframes_.size()
};

}  // namespace km
