#pragma once

#include <array>
#include <vector>

namespace km {

/// A crossing in a grid of ways: its column and row.
using Crossing = std::array<int, 2>;

/// Four closed ways over a grid of at least 4 columns and 3 rows of crossings. The first two share
/// four ways in one direction; the third meets both on some and follows them on others; the fourth
/// follows the third and meets the first two. Each comes back to a way of its own, in the same
/// direction, after one block.
[[nodiscard]] const std::array<std::vector<Crossing>, 4>& crossing_routes();

}  // namespace km
