#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"

namespace km {

// Largest distance of two candidates for one transform that agree. It allows for the drift of
// odometry between them.
inline constexpr double kAlignedRotation_rad = 0.3;
inline constexpr double kAlignedTranslation_m = 10.0;

struct [[nodiscard]] FrameAlignment {
  SE3 T = SE3::Identity();
  std::vector<std::size_t> inliers;  ///< Candidates within the last tolerance of T, ascending.
};

/// Robust average of candidates for one transform. Many of them may be wrong. It minimises the
/// truncated sum of squares sum_k w_k min(1, d_k^2). d_k^2 is the larger of two squared distances,
/// each relative to its tolerance: the chordal distance of the rotations and the distance of the
/// translations. Every candidate is tried as the start. Then the tolerance is halved, and the
/// inliers are tried again, as long as the best one keeps half of the weight of the first inliers.
/// True and false candidates that are near each other are thus not averaged. The inliers of the
/// last tolerance, with equal weights, are averaged until they no longer change.
///
/// Translations are compared at the origin of the frames. This origin should be near the
/// measurements, because otherwise rotation errors count a second time through the lever arm.
/// nullopt if there is no candidate. O(n^2). `weights` w: one per candidate; empty: all are 1.
/// Throws std::invalid_argument if a weight is not positive.
[[nodiscard]] std::optional<FrameAlignment> align_frames(std::span<const SE3> candidates,
                                                         const std::vector<double>& weights = {});

}  // namespace km
