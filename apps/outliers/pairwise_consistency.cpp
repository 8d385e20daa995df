#include "apps/outliers/pairwise_consistency.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include "modules/core/covariance.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "modules/pose_graph/robust/gnc_edges.hpp"
#include "modules/pose_graph/robust/gnc_team.hpp"

namespace km {
namespace {

// Poses of all robots along their odometry, in the numbering of the graph.
class OdometryChains {
 public:
  OdometryChains(const TeamGraph& graph, const std::vector<bool>& odometry, double noise_scale)
      : graph_(graph), variance_scale_(noise_scale * noise_scale) {
    const auto n = static_cast<std::size_t>(graph.poses());
    std::vector<const BlockEdge*> step_to(n, nullptr);
    for (std::size_t k = 0; k < odometry.size(); ++k)
      if (odometry[k]) step_to[static_cast<std::size_t>(graph.edges[k].j)] = &graph.edges[k];
    for (std::size_t i = 0; i < n; ++i) {
      const KeyframeId id = id_of(static_cast<Eigen::Index>(i));
      UncertainPose T;
      if (id.index > 0) {
        const BlockEdge* step = step_to[i];
        if (step == nullptr || step->i + 1 != step->j)
          throw std::invalid_argument("no odometry leads to pose " + to_string(graph.ids[i]));
        T = compose({poses_[i - 1].T_odom_kf, poses_[i - 1].covariance},
                    {step->T_i_j, covariance(*step)});
      }
      poses_.push_back({id, T.T, T.Sigma});
    }
  }

  [[nodiscard]] Closure closure(const BlockEdge& e) const {
    return {poses_[static_cast<std::size_t>(e.i)],
            poses_[static_cast<std::size_t>(e.j)],
            e.T_i_j,
            covariance(e),
            0,
            0.0};
  }

 private:
  [[nodiscard]] Matrix6 covariance(const BlockEdge& e) const {
    return variance_scale_ * edge_covariance(e, graph_.dimension);
  }
  [[nodiscard]] KeyframeId id_of(Eigen::Index pose) const {
    const std::size_t robot = graph_.robot_of(pose);
    return {static_cast<RobotId>(robot), static_cast<KeyframeIndex>(pose - graph_.first[robot])};
  }

  const TeamGraph& graph_;
  double variance_scale_;
  std::vector<OdometryPose> poses_;
};

}  // namespace

std::vector<bool> pairwise_consistent(const TeamGraph& graph, const PcmConfig& config,
                                      double noise_scale) {
  std::vector<bool> kept = odometry_edges(graph);
  const OdometryChains chains(graph, kept, noise_scale);
  std::map<std::pair<RobotId, RobotId>, Pcm> pairs;
  std::map<ClosureId, std::size_t> edge_of;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (kept[k]) continue;
    const Closure closure = chains.closure(graph.edges[k]);
    if (!edge_of.emplace(closure.id(), k).second) continue;
    const auto [a, b] = std::minmax({closure.from.id.robot, closure.to.id.robot});
    (void)pairs.try_emplace({a, b}, a, b, config).first->second.add(closure);
  }
  for (const auto& [pair, pcm] : pairs)
    for (const ClosureId& id : pcm.inliers()) kept[edge_of.at(id)] = true;
  return kept;
}

}  // namespace km
