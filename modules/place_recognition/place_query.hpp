#pragma once

#include "modules/core/ids.hpp"
#include "modules/place_recognition/candidate_filter.hpp"

namespace km {

/// What the place recognition node did with a keyframe.
enum class PlaceQueryStatus {
  kSearched,         ///< See `search`, which may have refused it as well.
  kOtherVocabulary,  ///< The peer uses another vocabulary: nothing of it can be compared.
  kUnknownWords,     ///< Words beyond the vocabulary, although it claims to be ours.
  kRepeated,         ///< This keyframe has arrived before.
};

/// A keyframe that was searched for, or why it was not: for counting and reports.
struct PlaceQuery {
  KeyframeId query;
  PlaceQueryStatus status = PlaceQueryStatus::kSearched;
  CandidateSearch search;  ///< Indices are those of own keyframes.
};

}  // namespace km
