#pragma once

#include <string>
#include <vector>

#include "apps/lab/crowd/recorded_place.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// Scores of pairs of keyframes, see score(): median and largest.
struct ScoreRange {
  double median = 0.0;
  double largest = 0.0;
};

/// Statistics of a recorded place, and of the places made of it.
struct PlaceStatistics {
  double words = 0.0;      ///< Mean number of words of a keyframe.
  double bytes = 0.0;      ///< Mean size of a packed bag.
  ScoreRange consecutive;  ///< Keyframe and the one before it.
  ScoreRange revisit;      ///< Keyframe of the second visit, most similar one of the first.
  ScoreRange disguised;    ///< The same after one of the two visits is disguised.
  ScoreRange elsewhere;    ///< Keyframe of this recording, most similar one of each other.
};

/// Statistics of `recordings[which]`, by the heaviest `words` words of each keyframe.
[[nodiscard]] PlaceStatistics statistics_of(const std::vector<RecordedPlace>& recordings,
                                            std::size_t which, const Vocabulary& vocabulary,
                                            std::size_t words);

}  // namespace km
