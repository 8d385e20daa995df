#include "apps/outliers/spoiled_graph.hpp"

#include <random>
#include <stdexcept>

#include "modules/outlier_rejection/random_outliers.hpp"
#include "modules/pose_graph/robust/gnc_team.hpp"

namespace km {

SpoiledGraph spoil(const TeamGraph& graph, std::size_t count, double half_side_m, unsigned seed) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<std::size_t> closures;
  for (std::size_t k = 0; k < odometry.size(); ++k)
    if (!odometry[k]) closures.push_back(k);
  if (closures.empty()) throw std::invalid_argument("spoil: the graph has no loop closure");
  SpoiledGraph spoiled{.graph = graph, .own_edges = graph.edges.size()};
  std::mt19937 rng(seed);
  const RandomOutlierModel model{.keyframes = static_cast<std::size_t>(graph.poses()),
                                 .planar = graph.dimension == 2,
                                 .half_side_m = half_side_m};
  std::uniform_int_distribution<std::size_t> closure(0, closures.size() - 1);
  for (const RelativePose& e : random_outliers(count, model, rng)) {
    const BlockEdge& claimed = graph.edges[closures[closure(rng)]];
    spoiled.graph.edges.push_back({static_cast<Eigen::Index>(e.from.index),
                                   static_cast<Eigen::Index>(e.to.index), e.T_from_to,
                                   claimed.kappa, claimed.tau});
  }
  return spoiled;
}

}  // namespace km
