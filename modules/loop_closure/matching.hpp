#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/keyframe.hpp"
#include "modules/loop_closure/relative_pose.hpp"

namespace km {

/// Descriptors are matched by their first bytes: 96 of 256 tests. The tests of ORB are sorted by a
/// greedy search for tests of high variance that are independent of those before (Rublee et al.,
/// "ORB", ICCV 2011, Sec. 4.3), so the first ones distinguish points best. Words need all tests.
/// The module's README compares numbers of bytes.
inline constexpr std::size_t kMatchedBytes = 12;

/// Keypoint `a` of one keyframe and similar keypoint `b` of another.
struct Match {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  int distance = 0;  ///< Hamming distance of the matched bytes, 0 to 96.

  auto operator<=>(const Match&) const = default;
};

/// Conditions for a pair of descriptors to be a match.
struct MatchRules {
  double max_ratio = 0.85;  ///< Best distance over second best, as seen from a.
  int max_distance = 24;    ///< [bit]
};

/// Pairs that are each other's nearest descriptor and pass `rules` (the ratio is that of Lowe,
/// "Distinctive Image Features from Scale-Invariant Keypoints", IJCV 2004), in ascending order of
/// `a`. The first of equally near descriptors counts. With fewer than two descriptors in `b` there
/// is no ratio, and so no match. O(|a| |b|).
[[nodiscard]] std::vector<Match> match_descriptors(std::span<const BinaryDescriptor> a,
                                                   std::span<const BinaryDescriptor> b,
                                                   const MatchRules& rules);

/// Conditions for a match when the pose is roughly known.
struct GuidedMatchRules {
  double radius_px = 8.0;  ///< Around the projection, at the finest level.
  double max_ratio = 0.9;  ///< Best distance over second best inside the radius.
  int max_distance = 24;   ///< [bit]
};

/// Matches under a known pose. Every point with depth of either keyframe is projected into the
/// other keyframe. The point is compared with the descriptors near its projection whose depth does
/// not contradict the point. Returns pairs that are each other's best, ascending in a.
[[nodiscard]] std::vector<Match> match_guided(const SE3& T_a_b, const KeyframeFeatures& a,
                                              const KeyframeFeatures& b,
                                              const GuidedMatchRules& rules);

}  // namespace km
