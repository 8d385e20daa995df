#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/loop_closure/word_points.hpp"

namespace km {

/// Largest number of points; bytes that claim more are refused.
inline constexpr std::size_t kMaxWordPoints = 10000;

/// Encodes points that ascend by their words, in about 6 bytes a point. The scale of the keypoints
/// comes first, and then their number. The word of a point is stated by the words skipped since the
/// one before (Elias gamma code), and its keypoint as in packed_keypoints.hpp. Precondition: every
/// point has a depth.
[[nodiscard]] std::vector<std::uint8_t> pack(const WordPoints& points);

/// Inverse of pack(). nullopt if the bytes end early or late, claim more than kMaxWordPoints
/// points, state a scale of no camera (see read_scale()), or a point without a depth.
[[nodiscard]] std::optional<WordPoints> unpack_word_points(std::span<const std::uint8_t> bytes);

}  // namespace km
