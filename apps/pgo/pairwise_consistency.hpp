#pragma once

#include <vector>

#include "modules/outlier_rejection/pcm_config.hpp"
#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// Which edges of a graph pairwise consistency maximisation keeps: odometry, and of the closures
/// between two robots, or inside one, the largest set that agrees pairwise, see Pcm. Closures come
/// in the order of the edges; a second one from the same pose to the same pose is dropped. Sigmas
/// of all edges are taken to be `noise_scale` times those of the graph.
/// Throws std::invalid_argument if a robot's odometry is interrupted, and as Pcm does.
[[nodiscard]] std::vector<bool> pairwise_consistent(const TeamGraph& graph, const PcmConfig& config,
                                                    double noise_scale = 1.0);

}  // namespace km
