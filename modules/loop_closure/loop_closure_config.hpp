#pragma once

#include <cstdint>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the verification of loop closures and of its traffic.
struct LoopClosureConfig {
  static constexpr const char* kSection = "loop_closure";

  double keypoint_noise_px = 0.7;
  double disparity_noise_px = 0.3;
  double max_match_ratio = 0.85;
  int max_match_distance = 64;
  int max_ransac_iterations = 2000;
  int min_consensus = 12;
  int min_inliers = 15;
  double max_position_sigma_m = 0.12;
  double max_rotation_sigma_rad = 0.05;
  double systematic_rotation_rad = 0.003;
  double systematic_translation_m = 0.008;
  double request_timeout_s = 2.0;
  int max_outstanding_requests = 8;
  int max_link_separation = 16;
  int attempt_separation = 2;
  double failure_patience = 2.0;
  int reply_keypoints = 200;
  int full_keyframes = 50;
  int cached_keyframes = 500;
  std::uint32_t seed = 1;

  void visit_fields(auto& visitor) {
    visitor.field("keypoint_noise_px", keypoint_noise_px, {0.05, 10.0},
                  "[px] standard deviation of a keypoint at the finest level; with the next, "
                  "decides who is an inlier");
    visitor.field("disparity_noise_px", disparity_noise_px, {0.02, 10.0},
                  "[px] the same of the disparity of its stereo match");
    visitor.field("max_match_ratio", max_match_ratio, {0.1, 1.0},
                  "best over second best descriptor distance of a match");
    visitor.field("max_match_distance", max_match_distance, {1, 256},
                  "[bit of 256] largest descriptor distance of a match");
    visitor.field(
        "max_ransac_iterations", max_ransac_iterations, {10, 1000000},
        "samples drawn at most; more find poses among more wrong matches, and take longer");
    visitor.field("min_consensus", min_consensus, {3, 1000},
                  "matches made without knowing the pose that must agree with it; below about ten, "
                  "chance alone makes some agree");
    visitor.field("min_inliers", min_inliers, {6, 1000},
                  "correspondences that must support a closure in the end");
    visitor.field("max_position_sigma_m", max_position_sigma_m, {1e-3, 100.0},
                  "[m] largest standard deviation of a closure's position without the 15 % of its "
                  "inliers that hold it the most; larger accepts closures that hang on a few "
                  "points or a small patch");
    visitor.field("max_rotation_sigma_rad", max_rotation_sigma_rad, {1e-4, 3.0},
                  "[rad] the same of its rotation");
    visitor.field("systematic_rotation_rad", systematic_rotation_rad, {0.0, 1.0},
                  "[rad per axis] error that does not average out over points (calibration, "
                  "shutter), added to every covariance");
    visitor.field("systematic_translation_m", systematic_translation_m, {0.0, 10.0},
                  "[m per axis] the same");
    visitor.field("request_timeout_s", request_timeout_s, {0.01, 3600.0},
                  "[s] after which an unanswered request is repeated");
    visitor.field("max_outstanding_requests", max_outstanding_requests, {1, 1000},
                  "under way to one peer at a time; others wait");
    visitor.field("max_link_separation", max_link_separation, {0, 1000},
                  "a peer's keyframe is not asked for with both keyframes of the candidate so near "
                  "to those of a verified closure [keyframes]; grows up to this with the peer's "
                  "keyframes that led to closures, see RequestEconomy; 0: ask for all");
    visitor.field(
        "attempt_separation", attempt_separation, {0, 1000},
        "[keyframes] nor so near to another that was asked for, likewise growing; 0: ask for all");
    visitor.field("failure_patience", failure_patience, {0.0, 100.0},
                  "of candidates whose like have failed n times beyond the first few, this times n "
                  "are passed over before one is asked for; 0: none");
    visitor.field("reply_keypoints", reply_keypoints, {50, 100000},
                  "of a keyframe that a peer is sent at most, 40 B each: those most likely to "
                  "correspond, as far down as a quarter of it, see chosen_by_words(); up to three "
                  "times as many in the first dozen replies to a robot");
    visitor.field(
        "full_keyframes", full_keyframes, {1, 1000000},
        "newest own ones in memory with all keypoints, 48 B each; older ones are read from "
        "the run's journal when needed, or keep twice reply_keypoints where it is not "
        "on the disk");
    visitor.field("cached_keyframes", cached_keyframes, {1, 1000000},
                  "of peers, kept for further candidates; about 10 kB each");
    visitor.field("seed", seed, {0U, ~0U}, "of the sampling");
  }
};

}  // namespace km
