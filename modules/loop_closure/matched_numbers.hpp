#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "modules/core/keyframe.hpp"

namespace km {

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

}  // namespace km
