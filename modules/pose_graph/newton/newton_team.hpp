#pragma once

#include <vector>

#include "modules/pose_graph/newton/newton_agent.hpp"
#include "modules/pose_graph/team/team_solver.hpp"

namespace km {

/// NewtonAgents of a whole team in one process.
class NewtonTeam : public TeamSolver {
 public:
  /// `start` is r x 4n in the numbering of `graph`, poses lifted as by lift(): the method stays
  /// among those, in which the gradient of the lifted cost lies. Empty: chordal initialisation by
  /// the team itself; then blocks are lifted identities until it is done. A graph with verticals
  /// takes a start, with z up.
  /// Throws std::invalid_argument if the shape is not that, the rank is below 3, or the graph is
  /// refused (see RobotGraph) or not connected, or has verticals without a start.
  NewtonTeam(const TeamGraph& graph, Eigen::Index rank, const LiftedPoses& start,
             NewtonOptions options);

  bool step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }
  [[nodiscard]] const NewtonAgent& agent(std::size_t robot) const { return agents_[robot]; }

 private:
  Eigen::Index rank_;
  std::vector<NewtonAgent> agents_;
  std::vector<LiftedPoses> blocks_;
  bool met_ = false;
};

}  // namespace km
