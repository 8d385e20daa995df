#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/io/json.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {

/// Drift: relative errors over segments of the path, divided by the segment's length.
struct SegmentErrors {
  std::vector<double> lengths_m;  ///< Nominal lengths that were used, ascending.
  std::vector<double> translation_percent;
  std::vector<double> rotation_deg_per_m;
};

/// Lengths over which drift is measured on a path of `path_m`, ascending. These are the four
/// longest of ..., 0.5, 1, 2, 5, 10, 20, ... [m] that are at most half of the path. The result is
/// empty for a path below 2 cm.
[[nodiscard]] std::vector<double> segment_lengths(double path_m);

/// Errors over the segment_lengths() of the true path, summed over the positions in between. For
/// every pair i and length, j is the first pair after i at which the path has that length. With
/// E = (T_truth_i^-1 T_truth_j)^-1 (T_estimate_i^-1 T_estimate_j), the errors are |t(E)| and
/// angle(E) divided by the true path from i to j.
///
/// This follows the odometry benchmark of Geiger et al., "Are we ready for Autonomous Driving?",
/// CVPR 2012, Sec. 2.5. The benchmark starts at every tenth frame and divides by the nominal
/// length. O(n) per length.
[[nodiscard]] SegmentErrors segment_errors(std::span<const PosePair> pairs);

/// The rigid transform T_truth_estimate with the smallest squared distance between the positions of
/// the pairs, by Umeyama, "Least-Squares Estimation of Transformation Parameters Between Two Point
/// Patterns", PAMI 1991, Eq. (40)-(43), without scale. Precondition: at least one pair. With less
/// than three positions, or positions on one line, part of the rotation is arbitrary.
[[nodiscard]] SE3 align(std::span<const PosePair> pairs);

/// Distances between the positions of pairs after align() [m].
[[nodiscard]] std::vector<double> aligned_errors_m(std::span<const PosePair> pairs);

/// One estimate with its truth; both ascending and outliving the call.
struct TrajectoryInput {
  std::string name;
  std::span<const StampedPose> truth;
  std::span<const StampedPose> estimate;
  std::optional<TimeWindow> window;  ///< Part of the truth that counts; by default all of it.
};

/// Errors of one estimate, or of all together.
struct TrajectoryError {
  std::string name;
  std::size_t poses = 0;         ///< Number of poses of the estimate.
  Statistics position_m;         ///< Absolute trajectory error; count: pairs compared.
  Statistics rotation_deg;       ///< Angle to the truth after the same alignment.
  Statistics rpe_translation_m;  ///< Relative pose error over a second.
  Statistics rpe_rotation_deg;
  std::vector<double> segment_lengths_m;  ///< Lengths of the segments for drift.
  Statistics drift_percent;               ///< Relative position error in percent of the distance.
  Statistics drift_deg_per_m;             ///< Relative rotation error over the distance.
  double completeness = 0.0;              ///< Share of the window covered, 0 to 1.
};

/// Errors of a team with one common alignment.
struct TeamError {
  SE3 T_truth_estimate = SE3::Identity();
  TrajectoryError joint;                ///< All pairs together.
  std::vector<TrajectoryError> robots;  ///< In the order of the inputs.
};

/// Aligns all estimates by one rigid transform and compares each with its truth.
///
/// Absolute error: distance between the aligned and the true position, at every pair of
/// associate(). Relative error: for pairs i, j with j nearest to a second after i, within a tenth
/// of it, (T_truth_i^-1 T_truth_j)^-1 (T_estimate_i^-1 T_estimate_j). Drift: segment_errors() over
/// lengths that fit the path; the team's drift is that of all robots. Completeness: covered time of
/// the estimate divided by the window; the team's is the ratio of the sums.
///
/// Throws std::invalid_argument with the name of the estimate if it shares fewer than three poses
/// with its truth. Throws it also if there is no input.
[[nodiscard]] TeamError trajectory_error(std::span<const TrajectoryInput> inputs);

/// How the poses of a truth and an estimate seem to be written differently, or empty: with this
/// undone, the motion over a second errs by less than a tenth.
[[nodiscard]] std::string difference_of_notation(const TrajectoryInput& input);

/// The rigid transform T_truth_estimate that best moves the surroundings of the robots to their
/// true position. It minimises the squared distance between six points around each estimated pose,
/// 5 m from it along its axes, and the same points around the true pose. align() uses only
/// positions. These leave the roll of a map undetermined if the path was straight, and determine
/// its rotation poorly if the path is short. All estimates are moved by the one transform.
///
/// Throws std::invalid_argument with the name of the estimate if it shares no pose with its truth,
/// and if there is no input.
[[nodiscard]] SE3 align_surroundings(std::span<const TrajectoryInput> inputs);

/// A table for people with one line per estimate, and one for the team if there are several.
/// Missing relative errors are "-", with a note below the table.
[[nodiscard]] std::string to_table(const TeamError& team);

/// The errors as one JSON object: {alignment: {translation_m, rotation_xyzw}, robots:
/// [{name, poses, pairs, position_m: {rmse, ...}, ...}], joint: {...}}.
void to_json(Json& json, const TeamError& team);

/// The JSON object of one estimate.
void to_json(Json& json, const TrajectoryError& error);

}  // namespace km
