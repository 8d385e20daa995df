#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "apps/lab/simulation/world/world.hpp"

namespace km {

/// The closed way `right_m` to the right of the closed centre line through `nodes` in driving
/// direction, both without rounded corners. Nodes may be visited more than once. Throws
/// std::invalid_argument for fewer than three nodes, two neighbours at one place, or a turn back.
[[nodiscard]] std::vector<Eigen::Vector2d> right_hand_lane(std::span<const Eigen::Vector2d> nodes,
                                                           double right_m);

/// The route in the opposite direction, `apart_m` to the left of `route`.
[[nodiscard]] Route opposite_route(const Route& route, double apart_m);

/// A crossing in a grid of streets: its column and row.
using Crossing = std::array<int, 2>;

/// Four closed routes over a grid of at least 4 columns and 3 rows of crossings, which begin
/// between the first crossing and the second. The second route follows the first from one street
/// behind over three streets. The third meets both in the opposite direction first, and follows
/// them on the street on which both begin. The fourth follows the second and the third. Each
/// returns to a street of its own, in the same direction, after one block.
[[nodiscard]] const std::array<std::vector<Crossing>, 4>& crossing_routes();

}  // namespace km
