#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace km {

// Sample i of n lies in column i of an n x n grid, in the row given here: of all such sets, those
// whose count on one side of a straight edge follows the area best, over all edges (by search).
inline constexpr std::array<int, 4> kRows4 = {1, 3, 0, 2};
inline constexpr std::array<int, 8> kRows8 = {7, 2, 4, 1, 6, 3, 5, 0};
inline constexpr std::array<int, 16> kRows16 = {4, 13, 8,  0, 5, 11, 14, 2,
                                                9, 6,  12, 1, 7, 15, 3,  10};

// From the pixel's centre; n is 2, 4, 8 or 16.
inline Eigen::Vector2f sample_offset(std::size_t i, std::size_t n) {
  const int row = n == 16  ? kRows16[i]
                  : n == 8 ? kRows8[i]
                  : n == 4 ? kRows4[i]
                           : static_cast<int>(i);
  const auto count = static_cast<float>(n);
  return {(static_cast<float>(i) + 0.5F) / count - 0.5F,
          (static_cast<float>(row) + 0.5F) / count - 0.5F};
}

}  // namespace km
