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
  int max_match_distance = 24;
  int max_ransac_iterations = 2000;
  int min_consensus = 12;
  int min_inliers = 15;
  double max_position_sigma_m = 0.12;
  double max_rotation_sigma_rad = 0.025;
  double max_own_rotation_sigma_rad = 0.015;
  double systematic_rotation_rad = 0.003;
  double systematic_translation_m = 0.008;
  double request_timeout_s = 2.0;
  int max_outstanding_requests = 8;
  int max_closure_separation = 64;
  int max_request_separation = 4;
  double min_closure_probability = 0.5;
  int min_word_points = 7;
  double min_word_share = 0.07;
  int reply_keypoints = 200;
  int full_keyframes = 50;
  int cached_keyframes = 500;
  std::uint32_t seed = 1;

  void visit_fields(auto& visitor) {
    visitor.field("keypoint_noise_px", keypoint_noise_px, {0.05, 10.0},
                  "[px] standard deviation of a keypoint at the finest level; with "
                  "disparity_noise_px it decides which matches are inliers");
    visitor.field("disparity_noise_px", disparity_noise_px, {0.02, 10.0},
                  "[px] standard deviation of the disparity of a keypoint's stereo match");
    visitor.field("max_match_ratio", max_match_ratio, {0.1, 1.0},
                  "largest ratio of the best to the second best descriptor distance of a match");
    visitor.field("max_match_distance", max_match_distance, {1, 96},
                  "[bit of 96] largest descriptor distance of a match");
    visitor.field("max_ransac_iterations", max_ransac_iterations, {10, 1000000},
                  "maximum number of samples; more samples find poses among more wrong matches, "
                  "and take longer");
    visitor.field("min_consensus", min_consensus, {3, 1000},
                  "least number of matches, made without knowing the pose, that agree with the "
                  "pose; about ten may agree by chance");
    visitor.field("min_inliers", min_inliers, {6, 1000},
                  "least number of correspondences that support the refined pose of a closure");
    visitor.field("max_position_sigma_m", max_position_sigma_m, {1e-3, 100.0},
                  "[m] largest standard deviation of a closure's position without the 15 % of its "
                  "inliers that determine it most; larger accepts closures that depend on a few "
                  "points or a small patch");
    visitor.field(
        "max_rotation_sigma_rad", max_rotation_sigma_rad, {1e-4, 3.0},
        "[rad] largest standard deviation of a closure's rotation, computed in the same way");
    visitor.field("max_own_rotation_sigma_rad", max_own_rotation_sigma_rad, {1e-4, 3.0},
                  "[rad] bound for a closure inside a robot, in place of max_rotation_sigma_rad if "
                  "it is smaller: odometry and other closures join such keyframes, too");
    visitor.field("systematic_rotation_rad", systematic_rotation_rad, {0.0, 1.0},
                  "[rad per axis] error that does not average out over points (calibration, "
                  "shutter), added to every covariance");
    visitor.field(
        "systematic_translation_m", systematic_translation_m, {0.0, 10.0},
        "[m per axis] error that does not average out over points, added to every covariance");
    visitor.field("request_timeout_s", request_timeout_s, {0.01, 3600.0},
                  "[s] time after which an unanswered request is repeated");
    visitor.field("max_outstanding_requests", max_outstanding_requests, {1, 1000},
                  "maximum number of unanswered requests to one peer; further ones wait");
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
    visitor.field("min_word_share", min_word_share, {0.0, 1.0},
                  "least share of those keypoints that must agree");
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
