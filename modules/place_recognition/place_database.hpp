#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/stamp.hpp"
#include "modules/place_recognition/bow_database.hpp"
#include "modules/place_recognition/place_recognition_config.hpp"

namespace km {

/// A keyframe that may show the same place as the query.
struct PlaceCandidate {
  std::size_t index = 0;    ///< In order of add().
  double similarity = 0.0;  ///< Normalised, see PlaceDatabase.
  int support = 1;          ///< Number of the query's candidates within 3 keyframes of this
                            ///< candidate, including itself.
};

/// Result of one query.
struct CandidateSearch {
  double normalizer = 0.0;                 ///< s(query, keyframe before it); 0 if there is none.
  std::vector<PlaceCandidate> candidates;  ///< At most max_candidates, by descending similarity.
};

/// The views of one robot, in order of time, and the search for earlier visits of a place.
///
/// The score of two images depends on their amount of texture. The score is therefore divided by
/// that of the query and the keyframe before it: eta = s(v_t, v_j) / s(v_t, v_(t-1)). One threshold
/// then suits all places (Galvez-Lopez and Tardos, TRO 2012; threshold 0.5 in Chang et al.,
/// "Kimera-Multi", Sec. III-A, with the words of all keypoints). Deviation from the first paper:
/// candidates need no temporal consistency, because geometric verification and outlier rejection
/// follow.
///
/// A keyframe is a view if it shows more than the view before it: s(v_t, v_view) is below
/// new_view_score. Other robots need only the views of a robot, and search only these. Const
/// members are thread-safe.
class PlaceDatabase {
 public:
  /// Smallest normaliser. A query with a lower one (fast rotation, darkness) is not used.
  static constexpr double kMinNormalizer = 0.05;
  /// Smallest time between two keyframes of one robot for a candidate [s].
  static constexpr double kMinGap_s = 10.0;

  /// For vectors of a vocabulary of `words` words. Throws ConfigError if `config` is out of bounds.
  PlaceDatabase(const PlaceRecognitionConfig& config, std::size_t words);

  /// Candidates among all keyframes for the keyframe `query` of another robot, with the normaliser
  /// that this robot has sent.
  CandidateSearch search(const BowVector& query, double normalizer) const;

  /// Candidates for a keyframe of this robot taken at `stamp`, not yet added. The search covers the
  /// keyframes that are at least kMinGap_s older or were added before mark_odometry_break(). The
  /// keyframe that was added or passed last normalises the score.
  CandidateSearch search_own(const BowVector& query, Stamp stamp) const;

  /// States that odometry hardly determines the pose of the next keyframe relative to the keyframe
  /// before it. All keyframes added so far then count as other places, whatever their age, and the
  /// next keyframe is a view.
  void mark_odometry_break() {
    known_from_ = stamps_.size();
    view_ = {};
  }

  /// Whether a keyframe of this robot, not yet added, is a view. One without words is none.
  [[nodiscard]] bool is_view(const BowVector& keyframe) const;

  /// Adds a keyframe and returns its index. Throws std::invalid_argument if `stamp` is before the
  /// last stamp, or if BowDatabase::add() does. The state is then unchanged.
  std::size_t add(BowVector vector, Stamp stamp);

  /// Takes a keyframe that is not added: it only normalises the score of the next one. Throws
  /// std::invalid_argument if `stamp` is before the last stamp.
  void pass(BowVector vector, Stamp stamp);

  std::size_t size() const { return stamps_.size(); }

 private:
  CandidateSearch search_among(const BowVector& query, double normalizer, std::size_t count) const;
  void expect_order(Stamp stamp) const;

  PlaceRecognitionConfig config_;
  BowDatabase database_;
  std::vector<Stamp> stamps_;                         // ascending
  Stamp newest_ = std::numeric_limits<Stamp>::min();  // stamp of the keyframe added or passed last
  std::size_t known_from_ = 0;
  BowVector last_;  // the keyframe added or passed last
  BowVector view_;  // the keyframe added last
};

/// Whether the place recognition node could search the places of a keyframe.
enum class PlaceQueryStatus {
  kSearched,
  kOtherVocabulary,  ///< The peer uses another vocabulary, so its keyframes cannot be compared.
  kUnknownWords,     ///< The peer states the same vocabulary but sent words outside of it.
  kRepeated,         ///< This keyframe has arrived before.
};

/// A received keyframe, for statistics.
struct PlaceQuery {
  KeyframeId query;
  PlaceQueryStatus status = PlaceQueryStatus::kSearched;
};

}  // namespace km
