#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/position_fix.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// A measured relative pose between two keyframes, of one robot or of two.
struct RelativePose {
  KeyframeId from;
  KeyframeId to;
  SE3 T_from_to = SE3::Identity();
  Matrix6 covariance = Matrix6::Identity();  ///< Covariance of T_from_to, see covariance.hpp.
};

/// Two keyframes that place recognition considers the same place. `match` is always one of this
/// robot's own keyframes; `query` is a peer's, or a later one of its own.
struct LoopCandidate {
  KeyframeId query;
  KeyframeId match;
  double similarity = 0.0;  ///< Normalised score of the bags of words.
  int support = 1;          ///< Number of candidates nearby, see PlaceCandidate.
};

/// Identity of a loop closure: a pair of keyframes, independent of the robot and the direction of
/// the measurement.
struct ClosureId {
  KeyframeId from;  ///< Lower keyframe id, see closure_id().
  KeyframeId to;
  auto operator<=>(const ClosureId&) const = default;
};

[[nodiscard]] constexpr ClosureId closure_id(const KeyframeId& a, const KeyframeId& b) {
  return b < a ? ClosureId{b, a} : ClosureId{a, b};
}

/// True if a keyframe of `closure` belongs to `robot`.
[[nodiscard]] constexpr bool touches(const ClosureId& closure, RobotId robot) {
  return closure.from.robot == robot || closure.to.robot == robot;
}

/// A geometrically verified loop closure with the odometry of both ends, so that every robot can
/// test its consistency without having received those keyframes before.
struct Closure {
  OdometryPose from;
  OdometryPose to;
  SE3 T_from_to = SE3::Identity();
  Matrix6 covariance = Matrix6::Identity();
  int inliers = 0;          ///< Correspondences that support it.
  double similarity = 0.0;  ///< Normalised score of the bag of words; 0 if unknown.

  [[nodiscard]] ClosureId id() const { return closure_id(from.id, to.id); }
  [[nodiscard]] RelativePose relative_pose() const {
    return {from.id, to.id, T_from_to, covariance};
  }
};

/// The mutually consistent closures between robots a <= b (or within one robot, a == b). Robot a
/// selects them for the pair, so that both robots use the same edges; the newest version counts.
struct InlierSet {
  RobotId a = 0;
  RobotId b = 0;
  std::uint32_t version = 0;
  std::vector<ClosureId> closures;  ///< Ascending.
};

/// Stages of a loop closure from the candidate of place recognition on.
enum class ClosureStage { kCandidate, kRequested, kReceived, kVerified, kInlier };

/// Last stage that a candidate reached, and the reason for its end: a row of loop_closures.csv.
struct ClosureOutcome {
  ClosureId id;
  double similarity = 0.0;
  ClosureStage stage = ClosureStage::kCandidate;
  std::string reason;  ///< Reason for its rejection; empty if it was not rejected.
  int matches = 0;     ///< Descriptor matches.
  int inliers = 0;     ///< Correspondences that support the pose.
};

/// A robot's optimised keyframe poses, index i being keyframe i of `robot`.
struct Trajectory {
  RobotId robot = 0;
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`; `robot` itself if it is alone.
  std::vector<SE3> T_world_kf;
  /// Covariances of T_world_kf relative to the first keyframe of the anchor, see covariance.hpp,
  /// without the keyframes after the last session. Empty while they are unknown, also after a
  /// refinement of the poses between sessions.
  std::vector<Matrix6> covariances = {};
  /// Standard deviation of the factor by which all distances in `world` may be wrong, not contained
  /// in `covariances`: see with_scale_error().
  double scale_sigma = 0.0;
  /// Last known public poses of other robots, T_world_kf.
  std::map<KeyframeId, SE3> public_poses = {};
};

/// State of distributed optimisation as seen by one robot, for status lines and tables.
struct OptimizerProgress {
  RobotId anchor = 0;
  std::vector<RobotId> members;  ///< Those in reach of the last session, ascending.
  /// Members whose place in the frame is not certain: closures at a single place tie them to this
  /// robot. Ascending.
  std::vector<RobotId> tentative = {};
  /// Members that no accepted closure ties to this robot. They are in another frame. Ascending.
  std::vector<RobotId> not_joined = {};
  /// False while no closures at two places tie this run of the robot to the runs before it.
  bool located = true;
  std::uint32_t round = 0;  ///< Number of rounds; every member sends once per round.
  double cost = 0.0;        ///< Chordal cost of the team, without factor 1/2.
  /// Norm of the team's Riemannian gradient, or (newton) its Newton decrement.
  double gradient_norm = 0.0;
  double seconds = 0.0;  ///< Time spent optimising.
  bool settled = false;  ///< Nothing is left to improve with the current data.
  /// Noise of this robot's odometry as a multiple of the stated noise, see OdometryNoise.
  double odometry_rotation_noise = 1.0;
  double odometry_translation_noise = 1.0;
  std::uint32_t odometry_breaks = 0;     ///< Number of wrong steps of odometry, see OdometryBreak.
  std::optional<FixesState> fixes = {};  ///< Absent without fixes.
};

}  // namespace km
