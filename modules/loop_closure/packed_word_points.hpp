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

/// Encodes points that ascend by their words, in about 6 bytes a point. Focal length, baseline,
/// largest bearing and largest inverse depth come first, as floats, and then the number of points.
/// The word of a point is stated by the words skipped since the one before (Elias gamma code). Each
/// axis of its bearing takes 12 bits, its inverse depth 10, and its octave 3. Bearings are rounded
/// by less than 0.2 px, and inverse depths by a thousandth of the largest. Precondition: every
/// point has a depth.
[[nodiscard]] std::vector<std::uint8_t> pack(const WordPoints& points);

/// Inverse of pack(). nullopt if the bytes end early or late, or claim more than kMaxWordPoints
/// points. So too if a number is not finite, a focal length or baseline not positive, a bearing
/// beyond 89.4 degrees, or a depth below 0.1 mm.
[[nodiscard]] std::optional<WordPoints> unpack_word_points(std::span<const std::uint8_t> bytes);

}  // namespace km
