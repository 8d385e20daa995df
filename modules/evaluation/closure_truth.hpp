#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/stamped_pose.hpp"
#include "modules/core/io/json.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {

/// A keyframe with its true pose, in one world for all keyframes.
struct TrueKeyframe {
  KeyframeId id;
  SE3 T_world_body = SE3::Identity();
  double scene_depth_m = 0.0;  ///< Median depth in its left camera; 0: unknown.
};

/// A loop closure that a robot considered.
struct ClosureRecord {
  ClosureId id;
  ClosureStage stage = ClosureStage::kCandidate;
  std::optional<SE3> T_from_to;  ///< Measured pose of body `to` in body `from`; from kVerified on.
  int matches = 0;               ///< Descriptor matches.
  int inliers = 0;               ///< Correspondences that support the pose.
  std::string reason = {};       ///< Reason for its rejection; empty if it was not rejected.
  /// Standard deviations of the pose, see core/data/covariance.hpp [rad, m]; 0: unknown.
  Vector6 sigma = Vector6::Zero();
};

/// Conditions under which a closure counts as true.
struct ClosureTruthOptions {
  static constexpr const char* kSection = "closure_truth";

  double max_translation_m = 0.5;
  double max_rotation_deg = 5.0;
  double min_overlap = 0.3;
  double default_depth_m = 5.0;

  void visit_fields(auto& visitor) {
    visitor.field("max_translation_m", max_translation_m, {1e-6, 1000.0},
                  "[m] a larger error is false unless the covariance of the pose explains it");
    visitor.field("max_rotation_deg", max_rotation_deg, {1e-6, 180.0},
                  "[deg] a larger error is false unless the covariance of the pose explains it");
    visitor.field("min_overlap", min_overlap, {1e-6, 1.0},
                  "two keyframes see the same place if at least this share of the image of each is "
                  "in the other's view");
    visitor.field("default_depth_m", default_depth_m, {1e-6, 1000.0},
                  "[m] depth of the scene, for keyframes without a measured depth");
  }
};

/// Share of the image of a camera at `a` that a camera at `b` sees, 0 to 1. All points are assumed
/// to be at depth `depth_m` in front of `a` (z in its frame). A point of a grid of 8x6 pixels, at
/// this depth, counts if it projects into the other image with between half and twice that depth.
/// T_a_b: relative pose of the cameras.
[[nodiscard]] double view_overlap(const Camera& camera, const SE3& T_a_b, double depth_m);

/// Number of true closures of one stage. Each direction of a pair is a closure of its own.
struct StageScore {
  std::size_t judged = 0;          ///< Closures whose keyframes both have a true pose.
  std::size_t correct = 0;         ///< True closures among them.
  std::size_t beyond_limits = 0;   ///< Poses with a larger error than the limits, false or not.
  std::size_t pairs_found = 0;     ///< Pairs of ClosureScores::true_pairs with a true closure.
  std::size_t frames_found = 0;    ///< Keyframes of these pairs.
  Statistics translation_error_m;  ///< Errors of measured poses; empty for candidates.
  Statistics rotation_error_deg;

  [[nodiscard]] double precision() const;  ///< correct / judged; NaN without one.
};

/// Pairs of keyframes of two robots that see the same place from directions a certain angle apart.
struct AngleScore {
  std::size_t true_pairs = 0;
  std::size_t pairs_found = 0;  ///< Pairs with a true closure of stage kInlier.
};

/// All closures of a team against the truth.
struct ClosureScores {
  static constexpr double kAngleBin_deg = 30.0;
  static constexpr std::size_t kAngleBins = 6;

  StageScore candidates;       ///< All closures; true if both keyframes see the same place.
  StageScore verified;         ///< Stages kVerified and kInlier; judged by the measured pose.
  StageScore inliers;          ///< Stage kInlier; judged by the measured pose.
  std::size_t true_pairs = 0;  ///< Pairs of keyframes of two robots that see the same place.
  /// Keyframes that see the same place as some keyframe of another robot.
  std::size_t true_frames = 0;
  std::size_t unjudged = 0;  ///< Closures with a keyframe whose true pose is unknown.
  /// The true pairs by the angle between the optical axes of their left cameras, in bins of
  /// kAngleBin_deg from 0 to 180 degrees.
  std::array<AngleScore, kAngleBins> by_angle = {};

  /// Share of the true pairs that a stage found. NaN without a true pair.
  [[nodiscard]] double pair_recall(const StageScore& stage) const;
  /// Share of the keyframes with a place common to another robot for which a stage found a closure.
  /// A system that uses the best match per keyframe can reach 1. NaN without such keyframes.
  [[nodiscard]] double frame_recall(const StageScore& stage) const;
};

/// Judges the closures of a team.
///
/// A candidate is true if its two keyframes see the same place: the smaller of both overlaps of
/// their left cameras' views is at least min_overlap. Its limits on distance and angle therefore
/// scale with the depth of the scene. The error of a verified closure and of an inlier is
/// T_from_to^-1 T_world_from^-1 T_world_to. They are false if it is beyond the limits, and if its
/// squares over the six variances sum to more than the 99.9 % quantile of chi-squared.
///
/// Precision includes closures within a robot. Recall counts only pairs of keyframes of two robots,
/// each pair once. A stage has found a pair if the keyframes see the same place and it has a true
/// closure between them, in either direction.
///
/// `camera` is the left one of every robot. Throws std::invalid_argument for a repeated keyframe, a
/// closure past kVerified without a pose, and ConfigError for options out of range. O(k^2) for k
/// keyframes.
[[nodiscard]] ClosureScores score_closures(std::span<const TrueKeyframe> keyframes,
                                           std::span<const ClosureRecord> closures,
                                           const Camera& camera,
                                           const ClosureTruthOptions& options = {});

/// A keyframe as recorded by its robot.
struct KeyframeRecord {
  KeyframeId id;
  Stamp stamp = 0;
  double scene_depth_m = 0.0;  ///< Median depth of its keypoints; 0: unknown.
};

/// Reads a robot's keyframes.csv: `robot, keyframe, stamp [ns], median depth [m]` below a header.
/// Throws InputFileError.
[[nodiscard]] std::vector<KeyframeRecord> read_keyframes(const std::filesystem::path& file);

/// Reads a robot's loop_closures.csv: `from_robot, from_keyframe, to_robot, to_keyframe,
/// similarity, stage, matches, inliers, tx, ty, tz, qx, qy, qz, qw`, six standard deviations, and
/// `reason` below a header. The pose [m] and its deviations [rad, m] are empty if there is none,
/// and the reason may be empty. Throws InputFileError, also for a verified closure without a pose.
[[nodiscard]] std::vector<ClosureRecord> read_closures(const std::filesystem::path& file);

/// The keyframes that have a true pose in `truth` (ascending), with this pose.
[[nodiscard]] std::vector<TrueKeyframe> place_keyframes(std::span<const KeyframeRecord> keyframes,
                                                        std::span<const StampedPose> truth);

/// A table for people. It has a line per stage with the numbers of true closures and of poses
/// beyond the limits. Precision, recall over pairs and over keyframes, and the errors of the
/// measured poses follow. Below are the totals for recall.
[[nodiscard]] std::string to_table(const ClosureScores& scores);

/// The scores as one JSON object, with the names of the members of ClosureScores and StageScore.
/// Errors of a stage without measured poses are null.
void to_json(Json& json, const ClosureScores& scores);

}  // namespace km
