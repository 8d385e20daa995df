#pragma once

#include <cstdint>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the verification of loop closures and of its traffic. Field names are the YAML
/// keys below `loop_closure:`.
struct LoopClosureConfig {
  static constexpr const char* kSection = "loop_closure";

  /// Standard deviation of a keypoint at the finest level of the pyramid, and of the disparity of
  /// its stereo match [px]. They decide who is an inlier.
  double keypoint_noise_px = 0.7;
  double disparity_noise_px = 0.3;

  /// Largest ratio of the best to the second best descriptor distance of a match, and its largest
  /// distance [bit].
  double max_match_ratio = 0.85;
  int max_match_distance = 64;

  /// Samples drawn at most. More find poses among more wrong matches and take longer.
  int max_ransac_iterations = 2000;

  /// Of the matches made without knowing the pose, how many must agree with it. Below about ten,
  /// chance alone makes some agree.
  int min_consensus = 12;

  /// Correspondences that must support a closure in the end.
  int min_inliers = 15;

  /// Largest standard deviation of a closure's position [m] and rotation [rad] that remains when
  /// the 15 % of its inliers that hold it the most are taken away. Larger values accept closures
  /// that hang on a few points, or on a small patch of the image.
  double max_position_sigma_m = 0.12;
  double max_rotation_sigma_rad = 0.05;

  /// Errors that do not average out over the points of a closure (calibration, shutter), added to
  /// its covariance, per axis.
  double systematic_rotation_rad = 0.003;
  double systematic_translation_m = 0.008;

  /// An unanswered request is repeated after this time [s].
  double request_timeout_s = 2.0;

  /// Requests under way to one peer at a time; the others wait.
  int max_outstanding_requests = 8;

  /// A peer's keyframe is not asked for near a verified closure: with both keyframes of the
  /// candidate at most so many keyframes from those of the closure. Grows up to this with the
  /// number of the peer's keyframes that led to closures, see RequestEconomy; 0: ask for all.
  int max_link_separation = 16;

  /// Nor is one asked for so near to another that was, likewise growing; 0: ask for all.
  int attempt_separation = 2;

  /// Of candidates whose like have failed n times beyond the first few, this times n are passed
  /// over before one is asked for; 0: all are.
  double failure_patience = 2.0;

  /// Keypoints of a keyframe that a peer is sent at most, 40 bytes each: those most likely to
  /// correspond, as far down as a quarter of it, see chosen_by_words(). Up to three times as many in
  /// the first dozen replies to a robot.
  int reply_keypoints = 200;

  /// Of own keyframes, so many of the newest are kept with all their keypoints, 48 bytes each;
  /// older ones with twice reply_keypoints, those that reduced() takes: where a robot works for
  /// hours, keyframes are what its memory goes on growing by.
  int full_keyframes = 500;

  /// Keyframes of peers kept for further candidates; each takes about 10 kB with the default
  /// reply_keypoints.
  int cached_keyframes = 500;

  /// Seed of the sampling.
  std::uint32_t seed = 1;

  void visit_fields(auto& visitor) {
    visitor.field("keypoint_noise_px", keypoint_noise_px, {0.05, 10.0}, "[px] finest level");
    visitor.field("disparity_noise_px", disparity_noise_px, {0.02, 10.0}, "[px]");
    visitor.field("max_match_ratio", max_match_ratio, {0.1, 1.0}, "best over second best");
    visitor.field("max_match_distance", max_match_distance, {1, 256}, "[bit] of 256");
    visitor.field("max_ransac_iterations", max_ransac_iterations, {10, 1000000},
                  "samples drawn at most");
    visitor.field("min_consensus", min_consensus, {3, 1000}, "matches that agree with the pose");
    visitor.field("min_inliers", min_inliers, {6, 1000}, "correspondences in the end");
    visitor.field("max_position_sigma_m", max_position_sigma_m, {1e-3, 100.0},
                  "[m] without the strongest inliers");
    visitor.field("max_rotation_sigma_rad", max_rotation_sigma_rad, {1e-4, 3.0},
                  "[rad] without the strongest inliers");
    visitor.field("systematic_rotation_rad", systematic_rotation_rad, {0.0, 1.0},
                  "[rad] per axis, in every covariance");
    visitor.field("systematic_translation_m", systematic_translation_m, {0.0, 10.0},
                  "[m] per axis, in every covariance");
    visitor.field("request_timeout_s", request_timeout_s, {0.01, 3600.0}, "[s] then repeated");
    visitor.field("max_outstanding_requests", max_outstanding_requests, {1, 1000}, "per peer");
    visitor.field("max_link_separation", max_link_separation, {0, 1000},
                  "keyframes around a closure not asked for; 0: ask for all");
    visitor.field("attempt_separation", attempt_separation, {0, 1000},
                  "keyframes around one asked for; 0: ask for all");
    visitor.field("failure_patience", failure_patience, {0.0, 100.0},
                  "candidates passed over per failure of their like; 0: none");
    visitor.field("reply_keypoints", reply_keypoints, {50, 100000}, "sent to a peer, 40 B each");
    visitor.field("full_keyframes", full_keyframes, {1, 1000000}, "newest own ones, 48 kB each");
    visitor.field("cached_keyframes", cached_keyframes, {1, 1000000}, "of peers, about 10 kB each");
    visitor.field("seed", seed, {0U, ~0U}, "of the sampling");
  }
};

}  // namespace km
