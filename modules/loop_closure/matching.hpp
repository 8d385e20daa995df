#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/loop_closure/relative_pose.hpp"

namespace km {

/// The first 96 of the 256 tests of each descriptor. The tests of ORB are sorted by a greedy search
/// for tests of high variance that are independent of those before (Rublee et al., "ORB", ICCV
/// 2011, Sec. 4.3), so the first ones distinguish points best.
[[nodiscard]] std::vector<MatchedDescriptor> orb_bits(
    std::span<const BinaryDescriptor> descriptors);

/// Numbers of a network in a MatchedDescriptor, of 4 bits each.
inline constexpr std::size_t kMatchedNumbers = 2 * kMatchedBytes;

/// Steps per root mean square of the numbers, which are rounded to -7 to 7 steps. A number beyond 2
/// times the root mean square (5 % of a normal distribution) is cut off.
inline constexpr double kNumberSteps = 3.5;

/// Squared distance of two opposite vectors of numbers, in squared steps.
inline constexpr double kMaxNumberDistance = 4.0 * kMatchedNumbers * kNumberSteps * kNumberSteps;

/// Descriptor of `numbers` (kMatchedNumbers, finite). Only their direction counts. Numbers that are
/// all zero stay so.
[[nodiscard]] MatchedDescriptor descriptor_of_numbers(std::span<const float> numbers);

/// The rounded numbers in steps.
[[nodiscard]] std::array<std::int16_t, kMatchedNumbers> numbers_of(
    const MatchedDescriptor& descriptor);

/// The descriptors of `features` by `network`, where 0 stands for orb_bits(). Empty if they are
/// unknown.
[[nodiscard]] std::vector<MatchedDescriptor> matched_by(std::uint16_t network,
                                                        const KeyframeFeatures& features);

/// `features` of an own keyframe, to be compared by ORB.
[[nodiscard]] inline KeyframeFeatures without_network(KeyframeFeatures features) {
  features.matched.clear();
  features.network = 0;
  return features;
}

/// The network by which two keyframes are compared: that of both, otherwise 0.
[[nodiscard]] inline std::uint16_t common_network(const KeyframeFeatures& a,
                                                  const KeyframeFeatures& b) {
  return a.network == b.network ? a.network : 0;
}

/// Keypoint `a` of one keyframe and similar keypoint `b` of another.
struct Match {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  double distance = 0.0;  ///< 0 to 96: see match_descriptors().

  auto operator<=>(const Match&) const = default;
};

/// Largest distance of a match.
inline constexpr double kMaxMatchDistance = 8.0 * kMatchedBytes;

/// Conditions for a pair of descriptors to be a match.
struct MatchRules {
  double max_ratio = 0.85;     ///< Best distance over second best, as seen from a.
  double max_distance = 24.0;  ///< At most kMaxMatchDistance.
};

/// Pairs of keypoints that are each other's nearest and pass `rules` (the ratio is that of Lowe,
/// "Distinctive Image Features from Scale-Invariant Keypoints", IJCV 2004), in ascending order of
/// `a`. They are compared by common_network(): tests of ORB by their Hamming distance, numbers of a
/// network by the square of their Euclidean distance, as 96 parts of the largest one. The first of
/// equally near keypoints counts. With fewer than two keypoints in `b` there is no ratio, and so no
/// match. O(|a| |b|).
[[nodiscard]] std::vector<Match> match_descriptors(const KeyframeFeatures& a,
                                                   const KeyframeFeatures& b,
                                                   const MatchRules& rules);

/// Conditions for a match when the pose is roughly known.
struct GuidedMatchRules {
  double radius_px = 8.0;      ///< Around the projection, at the finest level.
  double max_ratio = 0.9;      ///< Best distance over second best inside the radius.
  double max_distance = 24.0;  ///< At most kMaxMatchDistance.
};

/// Matches under a known pose. Every point with depth of either keyframe is projected into the
/// other keyframe. The point is compared with the descriptors near its projection whose depth does
/// not contradict the point. Returns pairs that are each other's best, ascending in a.
[[nodiscard]] std::vector<Match> match_guided(const SE3& T_a_b, const KeyframeFeatures& a,
                                              const KeyframeFeatures& b,
                                              const GuidedMatchRules& rules);

}  // namespace km
