#pragma once

#include <vector>

#include "modules/pose_graph/robust/gnc_agent.hpp"
#include "modules/pose_graph/team/team_solver.hpp"

namespace km {

/// Which edges of a graph are odometry: from a pose to the next one of the same recording. A second
/// edge between the same two is a closure.
[[nodiscard]] std::vector<bool> odometry_edges(const TeamGraph& graph);

/// GncAgents of a whole team in one process.
class GncTeam : public TeamSolver {
 public:
  /// `start` is r x 4n in the numbering of `graph`, poses lifted as by lift(); empty: every robot
  /// starts from its odometry. Throws std::invalid_argument if the shape is not that, the rank is
  /// below 3, or as GncAgent does.
  GncTeam(const TeamGraph& graph, Eigen::Index rank, const LiftedPoses& start,
          const GncAgentOptions& options);

  bool step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }
  [[nodiscard]] const GncAgent& agent(std::size_t robot) const { return agents_[robot]; }
  /// Which edges of the graph are inliers, as the robot with the lower id holds it.
  [[nodiscard]] std::vector<bool> kept() const;

 private:
  TeamGraph graph_;
  Eigen::Index rank_;
  std::vector<GncAgent> agents_;
  std::vector<LiftedPoses> blocks_;
  bool met_ = false;
};

}  // namespace km
