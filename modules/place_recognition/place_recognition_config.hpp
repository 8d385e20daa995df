#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of place recognition.
struct PlaceRecognitionConfig {
  static constexpr const char* kSection = "place_recognition";

  int word_keypoints = 350;
  double similarity_threshold = 0.4;
  int max_candidates = 5;
  double new_view_score = 0.24;

  void visit_fields(auto& visitor) {
    visitor.field("word_keypoints", word_keypoints, {50, 4000},
                  "number of keypoints of a keyframe, the strongest, whose words are compared and "
                  "sent, about 0.8 B each; fewer: fewer bytes and fewer closures");
    visitor.field("similarity_threshold", similarity_threshold, {0.0, 10.0},
                  "least similarity of a candidate: its score over the query's score against the "
                  "keyframe before it; lower: more candidates, more work for verification");
    visitor.field("max_candidates", max_candidates, {1, 1000},
                  "maximum number of candidates per query, the most similar ones");
    visitor.field("new_view_score", new_view_score, {0.0, 2.0},
                  "the words of a keyframe are sent and searched if its score against the last "
                  "keyframe so sent is below this; otherwise it shows nearly the view of that one; "
                  "lower: fewer bytes and fewer closures between robots; 2: send all");
  }
};

}  // namespace km
