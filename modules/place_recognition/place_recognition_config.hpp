#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of place recognition. Field names are the YAML keys below `place_recognition:`.
struct PlaceRecognitionConfig {
  static constexpr const char* kSection = "place_recognition";

  /// Smallest similarity of a candidate: its score over the query's score against the keyframe
  /// before it. Lower: more candidates, more work for geometric verification.
  double similarity_threshold = 0.5;

  /// A query that resembles the keyframe before it less than this is not used: the ratio would say
  /// nothing (fast rotation, darkness).
  double min_normalizer = 0.05;

  /// Most candidates per query, the best ones.
  int max_candidates = 5;

  /// Keyframes of the same robot closer in time than this are neighbours, not loop closures [s].
  double min_gap_s = 10.0;

  /// Candidates of one query at least so far apart in time, the best of each place [s]; 0: any.
  double candidate_separation_s = 0.0;

  /// A peer's keyframe whose predecessor has not arrived waits for so many later ones; then its
  /// nearest earlier keyframe takes the predecessor's part.
  int max_waiting_keyframes = 10;

  void visit_fields(auto& visitor) {
    visitor.field("similarity_threshold", similarity_threshold, {0.0, 10.0},
                  "normalised score of a candidate");
    visitor.field("min_normalizer", min_normalizer, {0.0, 1.0},
                  "score against the keyframe before");
    visitor.field("max_candidates", max_candidates, {1, 1000}, "per query");
    visitor.field("min_gap_s", min_gap_s, {0.0, 1e6}, "[s] within one robot");
    visitor.field("candidate_separation_s", candidate_separation_s, {0.0, 1e6},
                  "[s] between candidates of a query, 0: any");
    visitor.field("max_waiting_keyframes", max_waiting_keyframes, {0, 10000},
                  "of a peer, until their predecessor comes");
  }
};

}  // namespace km
