#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/keyframe.hpp"

namespace km {

/// Largest number of keypoints of a keyframe; bytes that claim more are refused.
inline constexpr std::size_t kMaxKeypoints = 10000;

/// Encodes keypoints and the descriptors by which keyframes are matched, in 16.6 bytes a keypoint.
/// The scale comes first, then the number of keypoints, and each keypoint with its descriptor.
/// T_body_cam and the network are not part of it. Without keypoints there are no bytes.
/// Precondition: as many descriptors in KeyframeFeatures::matched as keypoints.
[[nodiscard]] std::vector<std::uint8_t> pack(const KeyframeFeatures& features);

/// Inverse of pack(), where T_body_cam is the identity and the network is 0. nullopt if the bytes
/// end early or late, claim more than kMaxKeypoints keypoints, or state a scale of no camera (see
/// read_scale()).
[[nodiscard]] std::optional<KeyframeFeatures> unpack_features(std::span<const std::uint8_t> bytes);

/// The bytes of all descriptors.
[[nodiscard]] std::vector<std::uint8_t> pack(std::span<const MatchedDescriptor> descriptors);

/// Inverse of pack(). nullopt if the bytes are not a whole number of descriptors, or more than
/// kMaxKeypoints.
[[nodiscard]] std::optional<std::vector<MatchedDescriptor>> unpack_descriptors(
    std::span<const std::uint8_t> bytes);

}  // namespace km
