#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/loop_closure/word_points.hpp"

namespace km {

// A keypoint takes 37 bits: 12 for each axis of its bearing, 10 for its inverse depth, and 3 for
// its octave. Focal length, baseline, the largest bearing and the largest inverse depth come before
// all keypoints, as four floats. In an image 752 pixels wide, bearings are rounded by less than 0.2
// px. Inverse depths are rounded by less than a thousandth of the largest one: with 128 px as the
// largest disparity, by 0.06 px.

/// Largest number of keypoints of a message; bytes that claim more are refused.
inline constexpr std::size_t kMaxKeypoints = 10000;

/// Encodes keypoints and the descriptors by which keyframes are matched, in 16.6 bytes a keypoint.
/// The scale comes first, then the number of keypoints, and each keypoint with its descriptor.
/// T_body_cam and the network are not part of it. Without keypoints there are no bytes.
/// Precondition: as many descriptors in KeyframeFeatures::matched as keypoints.
[[nodiscard]] std::vector<std::uint8_t> pack(const KeyframeFeatures& features);

/// Inverse of pack(), where T_body_cam is the identity and the network is 0. nullopt if the bytes
/// end early or late, claim more than kMaxKeypoints keypoints, or state a scale of no camera.
[[nodiscard]] std::optional<KeyframeFeatures> unpack_features(std::span<const std::uint8_t> bytes);

/// The bytes of all descriptors.
[[nodiscard]] std::vector<std::uint8_t> pack(std::span<const MatchedDescriptor> descriptors);

/// Inverse of pack(). nullopt if the bytes are not a whole number of descriptors, or more than
/// kMaxKeypoints.
[[nodiscard]] std::optional<std::vector<MatchedDescriptor>> unpack_descriptors(
    std::span<const std::uint8_t> bytes);

/// Encodes points that ascend by their words, in about 6 bytes a point. The scale of the keypoints
/// comes first, and then their number. The word of a point is stated by the words skipped since the
/// one before (Elias gamma code), and then its keypoint. Precondition: every point has a depth.
[[nodiscard]] std::vector<std::uint8_t> pack(const WordPoints& points);

/// Inverse of pack(). nullopt if the bytes end early or late, claim more than kMaxKeypoints points,
/// state a scale of no camera, or a point without a depth.
[[nodiscard]] std::optional<WordPoints> unpack_word_points(std::span<const std::uint8_t> bytes);

}  // namespace km
