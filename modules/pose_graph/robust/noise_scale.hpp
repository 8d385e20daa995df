#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "modules/pose_graph/team/team_graph.hpp"

namespace km {

/// How well a graph knows the noise of its closures.
struct NoiseScale {
  double scale = 1.0;       ///< Sigmas of closures are this many times what the graph says.
  double consistent = 1.0;  ///< Share of the pairs that are Gaussian noise of that scale.
  std::size_t pairs = 0;    ///< Of closures, that it was found from.
};

/// The scale of the closures' noise, before anything is optimised: from the cycles through two
/// closures of the same robots, a few poses apart at both ends, and the odometry between. Their
/// Mahalanobis length d, if both are true, is `scale` times that of a normal vector; pairs with a
/// false closure may have any. So the lengths are taken for a mixture of both, log d of the others
/// uniform, and the scale is the likeliest one (expectation maximisation of the share, for every
/// scale). Only lengths count: robots could tell each other theirs as a histogram. Cycles that turn
/// by more than 45 degrees, as most with a false closure do, are left out.
///
/// What two closures beside each other have in common does not show. nullopt if there are too few
/// pairs to tell. `odometry` marks the steps of odometry.
[[nodiscard]] std::optional<NoiseScale> noise_scale(const TeamGraph& graph,
                                                    const std::vector<bool>& odometry);

}  // namespace km
