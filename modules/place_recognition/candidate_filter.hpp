#pragma once

#include <cstddef>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/stamp.hpp"
#include "modules/place_recognition/bow_database.hpp"
#include "modules/place_recognition/place_recognition_config.hpp"

namespace km {

/// A keyframe that may show the same place as the query.
struct PlaceCandidate {
  std::size_t index = 0;    ///< In order of add().
  double similarity = 0.0;  ///< Normalised, see CandidateFilter.
  int support = 1;          ///< Number of candidates within 3 keyframes of this one, including
                            ///< itself.
};

enum class SearchStatus {
  kSearched,
  kNoPrevious,     ///< The query has no predecessor by which to normalise.
  kLowNormalizer,  ///< The query is too dissimilar to its predecessor.
};

/// Result of one query.
struct CandidateSearch {
  SearchStatus status = SearchStatus::kSearched;
  double normalizer = 0.0;                 ///< s(query, keyframe before it).
  std::size_t compared = 0;                ///< Keyframes that share a word with the query.
  std::size_t above = 0;                   ///< Compared keyframes at or above the threshold.
  double best_similarity = 0.0;            ///< Best similarity of all compared keyframes.
  std::vector<PlaceCandidate> candidates;  ///< By descending similarity; a part of those counted in
                                           ///< `above`.
};

/// The keyframes of one robot, in order of time, in which earlier visits of a place are searched.
///
/// The score of two images depends on their amount of texture. It is therefore divided by the score
/// of the query and the keyframe before it: eta = s(v_t, v_j) / s(v_t, v_(t-1)). So one threshold
/// suits all places (Galvez-Lopez and Tardos, TRO 2012; threshold 0.5 in Chang et al.,
/// "Kimera-Multi", Sec. III-A). Unlike there, candidates need no temporal consistency, because
/// geometric verification and outlier rejection follow. Const members are thread-safe.
class CandidateFilter {
 public:
  /// For vectors of a vocabulary of `words` words. Throws ConfigError if `config` is out of bounds.
  CandidateFilter(const PlaceRecognitionConfig& config, std::size_t words);

  /// Candidates among all keyframes for a keyframe of another robot. `previous`: the keyframe
  /// before it there, or null.
  CandidateSearch search(const BowVector& query, const BowVector* previous) const;

  /// Candidates for a keyframe of this robot taken at `stamp`, not yet added, among those at least
  /// min_gap_s older, or from before lose_way(). It is normalised by the keyframe added last.
  CandidateSearch search_own(const BowVector& query, Stamp stamp) const;

  /// From the keyframe added last to the next one the way is hardly known: they are no neighbours.
  void lose_way() { known_from_ = stamps_.size(); }

  /// Adds a keyframe; returns its index. Throws std::invalid_argument if `stamp` is before the last
  /// one or as BowDatabase::add(); state is unchanged then.
  std::size_t add(BowVector vector, Stamp stamp);

  std::size_t size() const { return stamps_.size(); }

 private:
  CandidateSearch search_among(const BowVector& query, const BowVector* previous,
                               std::size_t count) const;
  std::vector<PlaceCandidate> choose(const std::vector<BowMatch>& matches, double normalizer) const;

  PlaceRecognitionConfig config_;
  BowDatabase database_;
  std::vector<Stamp> stamps_;  // ascending
  std::size_t known_from_ = 0;
  BowVector last_;
};

/// Result of the place recognition node for one keyframe.
enum class PlaceQueryStatus {
  kSearched,         ///< See `search`, which may have refused it as well.
  kOtherVocabulary,  ///< The peer uses another vocabulary, so its keyframes cannot be compared.
  kUnknownWords,     ///< Words beyond the vocabulary, although the peer states the same vocabulary.
  kRepeated,         ///< This keyframe has arrived before.
};

/// A searched keyframe, or the reason why it was not searched, for statistics.
struct PlaceQuery {
  KeyframeId query;
  PlaceQueryStatus status = PlaceQueryStatus::kSearched;
  CandidateSearch search;  ///< Indices are those of own keyframes.
};

}  // namespace km
