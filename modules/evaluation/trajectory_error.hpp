#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/evaluation/association.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {

/// Drift: relative errors over pieces of the path, each divided by the piece's length.
struct SegmentErrors {
  std::vector<double> lengths_m;  ///< Nominal lengths that were used, ascending.
  std::vector<double> translation_percent;
  std::vector<double> rotation_deg_per_m;
};

/// Lengths over which drift is measured on a path of `path_m`: the four longest of ..., 0.5, 1, 2,
/// 5, 10, 20, ... [m] that are at most half of it, ascending. Empty for a path below 2 cm.
[[nodiscard]] std::vector<double> segment_lengths(double path_m);

/// For every pair i and every length, j is the first pair after i to which the true path, summed
/// over the positions in between, is at least that long. With E = (T_truth_i^-1 T_truth_j)^-1
/// (T_estimate_i^-1 T_estimate_j), the errors are |t(E)| and angle(E) over the true path from i to
/// j. As in the odometry benchmark of Geiger et al., "Are we ready for Autonomous Driving?", CVPR
/// 2012, Sec. 2.5; that starts at every tenth frame and divides by the nominal length. `scale`
/// multiplies the positions of the estimate. Throws std::invalid_argument for a length that is not
/// positive. O(n) per length.
[[nodiscard]] SegmentErrors segment_errors(std::span<const PosePair> pairs,
                                           std::span<const double> lengths_m, double scale = 1.0);

/// The same over segment_lengths() of the pairs' true path.
[[nodiscard]] SegmentErrors segment_errors(std::span<const PosePair> pairs, double scale = 1.0);

/// p_truth = scale * T_truth_estimate.linear() * p_estimate + T_truth_estimate.translation().
struct Alignment {
  double scale = 1.0;
  SE3 T_truth_estimate = SE3::Identity();

  /// A pose of the estimate in the truth's world; its position is scaled.
  [[nodiscard]] SE3 apply(const SE3& T_estimate_body) const;
};

/// The alignment with the least squared distance between the positions of the pairs, by Umeyama,
/// "Least-Squares Estimation of Transformation Parameters Between Two Point Patterns", PAMI 1991,
/// Eq. (40)-(43). With `with_scale` false the scale is 1. Precondition: at least one pair. Less
/// than three positions, or positions on one line, leave part of the rotation arbitrary. Throws
/// std::invalid_argument if a scale is asked for and either side does not move.
[[nodiscard]] Alignment align(std::span<const PosePair> pairs, bool with_scale);

/// How errors are measured.
struct TrajectoryErrorOptions {
  bool with_scale = false;          ///< Align by a similarity instead of a rigid transform.
  double max_gap_s = 0.1;           ///< Poses further apart are not interpolated between.
  double max_difference_s = 0.01;   ///< Without neighbours to interpolate: nearest pose, at most.
  double rpe_delta_s = 1.0;         ///< Time over which relative errors are taken.
  double max_coverage_gap_s = 2.0;  ///< Time between estimated poses that still counts as covered.
};

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
  std::size_t poses = 0;         ///< In the estimate.
  Statistics position_m;         ///< Absolute trajectory error; count: pairs compared.
  Statistics rotation_deg;       ///< Angle to the truth after the same alignment.
  Statistics rpe_translation_m;  ///< Relative pose error over rpe_delta_s.
  Statistics rpe_rotation_deg;
  std::vector<double> segment_lengths_m;  ///< Pieces of the path over which drift is taken.
  Statistics drift_percent;               ///< Relative position error in percent of the distance.
  Statistics drift_deg_per_m;             ///< Relative rotation error over the distance.
  double completeness = 0.0;              ///< Share of the window covered, 0 to 1.
};

/// Errors of a team under ONE alignment.
struct TeamError {
  Alignment alignment;
  TrajectoryError joint;                ///< All pairs together.
  std::vector<TrajectoryError> robots;  ///< In the order of the inputs.
};

/// Aligns all estimates by one transform and compares each with its truth.
///
/// Absolute: distance between the aligned and the true position, at every pair of associate().
/// Relative: for pairs i, j with j the nearest to rpe_delta_s after i, at most a tenth of it off,
/// (T_truth_i^-1 T_truth_j)^-1 (T_estimate_i^-1 T_estimate_j), with the estimate's scale corrected.
/// Drift: segment_errors() over lengths that fit the path; of the team, those of all robots.
/// Completeness: covered time of the estimate over the window; of the team, sums of both.
/// Throws std::invalid_argument, naming the estimate, if one shares fewer than three poses with its
/// truth, and for no input or options out of range.
[[nodiscard]] TeamError trajectory_error(std::span<const TrajectoryInput> inputs,
                                         const TrajectoryErrorOptions& options = {});

/// The rigid transform T_truth_estimate that best puts what robots saw where it is: of least
/// squared distance between six points around each estimated pose, `radius_m` from it along its
/// axes, and the same around the true one. align() looks at positions alone, which leave a map's
/// roll open where the way was straight, and turn it where the way is short. All estimates are
/// moved by the one transform. Throws std::invalid_argument, naming the estimate, if one shares no
/// pose with its truth, and for no input.
[[nodiscard]] SE3 align_surroundings(std::span<const TrajectoryInput> inputs, double radius_m = 5.0,
                                     const TrajectoryErrorOptions& options = {});

}  // namespace km
