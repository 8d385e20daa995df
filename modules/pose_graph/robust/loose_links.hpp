#pragma once

#include <span>
#include <vector>

#include "modules/pose_graph/robust/public_graph.hpp"

namespace km {

/// Links that no other link of the same two robots runs beside: such as random false ones, which
/// fill up a factorisation, while robots that meet do so for a while. None if they are few.
[[nodiscard]] std::vector<bool> loose_links(const PublicGraph& graph);

/// One node of each part of the team, but that of the middle node, that would fall off if there
/// were no loose links and none with weight zero.
[[nodiscard]] std::vector<int> nodes_to_hold(const PublicGraph& graph,
                                             const std::vector<bool>& loose,
                                             std::span<const double> weights);

}  // namespace km
