#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace km {

/// How far two candidates for one transform may lie apart and still agree.
struct AlignmentTolerance {
  double rotation_rad = 0.3;
  double translation_m = 10.0;
};

struct [[nodiscard]] FrameAlignment {
  Eigen::MatrixXd L;                 ///< r x 4, [Y p] with Y in St(3, r).
  std::vector<std::size_t> inliers;  ///< Candidates within tolerance of L, ascending.
};

/// Robust average of candidates [Y p] (r x 4) for one transform, of which many may be wrong:
/// minimises the truncated sum of squares sum_k w_k min(1, d_k^2), d_k^2 being the larger of the
/// squared chordal distance of the rotations and the squared distance of the translations, each
/// over its tolerance. Every candidate is tried as the start, the best one is refined by averaging
/// its inliers, each alike, until they no longer change. With rank 3 these are ordinary rigid
/// transforms.
///
/// Translations compare where the frames' origin lies: choose it near the measurements, or errors
/// of rotation are counted again through the lever. nullopt if there is no candidate. O(n^2 r).
/// `weights` w: one per candidate; empty: all are 1.
/// Throws std::invalid_argument if shapes differ or a tolerance or a weight is not positive.
[[nodiscard]] std::optional<FrameAlignment> align_frames(
    std::span<const Eigen::MatrixXd> candidates, const AlignmentTolerance& tolerance,
    const std::vector<double>& weights = {});

}  // namespace km
