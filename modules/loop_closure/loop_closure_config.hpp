#pragma once

#include <cstdint>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the verification of loop closures and of its traffic.
struct LoopClosureConfig {
  static constexpr const char* kSection = "loop_closure";

  int min_inliers = 15;
  double max_position_sigma_m = 0.12;
  double max_rotation_sigma_rad = 0.025;
  int max_closure_separation = 64;
  int max_request_separation = 4;
  double min_closure_probability = 0.5;
  int min_word_points = 7;
  int reply_keypoints = 200;
  int full_keyframes = 50;
  int cached_keyframes = 500;
  std::uint32_t seed = 1;

  void visit_fields(auto& visitor) {
    visitor.field("min_inliers", min_inliers, {6, 1000},
                  "least number of correspondences that support the refined pose of a closure");
    visitor.field("max_position_sigma_m", max_position_sigma_m, {1e-3, 100.0},
                  "[m] largest standard deviation of a closure's position without the 15 % of its "
                  "inliers that determine it most; larger accepts closures that depend on a few "
                  "points or a small patch");
    visitor.field(
        "max_rotation_sigma_rad", max_rotation_sigma_rad, {1e-4, 3.0},
        "[rad] largest standard deviation of a closure's rotation, computed in the same way");
    visitor.field(
        "max_closure_separation", max_closure_separation, {0, 1000},
        "[keyframes] a peer's keyframe is not requested if both keyframes of the candidate are "
        "this near to those of a verified closure; the distance grows up to this value with the "
        "number of the peer's keyframes that led to closures, see RequestPolicy; 0: request all");
    visitor.field(
        "max_request_separation", max_request_separation, {0, 1000},
        "[keyframes] a peer's keyframe is not requested if both keyframes of the candidate "
        "are this near to those of another requested candidate; the distance grows in the "
        "same way; 0: request all but the pairs that the peer compares");
    visitor.field("min_closure_probability", min_closure_probability, {0.0, 1.0},
                  "a peer's keyframe is requested if the candidate leads to a closure with this "
                  "probability, which is learned from the results of others; less probable ones "
                  "are requested in proportion to their probability; 0: request all");
    visitor.field("min_word_points", min_word_points, {0, 1000},
                  "a peer's keyframe is requested as a whole only if so many keypoints agree with "
                  "an own one by their words and positions, 6 B each, which are requested first; "
                  "0: request it as a whole at once");
    visitor.field(
        "reply_keypoints", reply_keypoints, {50, 100000},
        "maximum number of keypoints of a keyframe sent to a peer, those most likely to "
        "correspond: at first at most half, without descriptors, 6 B each; if these agree, "
        "their descriptors of 12 B, and the others, 17 B each");
    visitor.field("full_keyframes", full_keyframes, {1, 1000000},
                  "number of newest own keyframes in memory with all keypoints, 60 B each; older "
                  "ones are read from the run's journal when needed, or keep twice reply_keypoints "
                  "if the journal is not on the disk");
    visitor.field("cached_keyframes", cached_keyframes, {1, 1000000},
                  "number of keyframes of peers kept for further candidates; about 10 kB each");
    visitor.field("seed", seed, {0U, ~0U}, "seed of the sampling");
  }
};

}  // namespace km
