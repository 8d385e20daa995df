#pragma once

#include <vector>

#include "modules/pose_graph/robust/gnc_agent.hpp"
#include "modules/pose_graph/team/team_graph.hpp"

namespace km {

struct [[nodiscard]] CentralGnc {
  std::vector<bool> kept;  ///< Of the graph's edges; trusted ones are.
  std::vector<SE3> T_world_kf;
  int updates = 0;
};

/// The reference for GncAgent: the same schedule for the whole graph on one computer, the weighted
/// problems solved by the trust-region method of minimise() to a relative decrease of `tolerance`.
/// Starts from the chordal initialisation with all edges, unless poses are given. Throws
/// std::invalid_argument if edges are not usable.
CentralGnc gnc_centrally(const TeamGraph& graph, const GncAgentOptions& options,
                         double tolerance = 1e-3, std::vector<SE3> start = {});

}  // namespace km
