#pragma once

#include <span>
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

}  // namespace km
