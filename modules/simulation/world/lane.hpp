#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace km {

/// The closed way `right_m` to the right of the closed centre line through `nodes` in driving
/// direction, both without rounded corners. Nodes may be visited more than once. Throws
/// std::invalid_argument for fewer than three nodes, two neighbours at one place, or a turn back.
[[nodiscard]] std::vector<Eigen::Vector2d> right_hand_lane(std::span<const Eigen::Vector2d> nodes,
                                                           double right_m);

/// Distance of `p` from the closed way [m]. O(points).
[[nodiscard]] double distance_to_way(const Eigen::Vector2d& p,
                                     std::span<const Eigen::Vector2d> closed_way);

}  // namespace km
