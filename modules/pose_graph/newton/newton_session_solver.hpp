#pragma once

#include <set>
#include <vector>

#include "modules/pose_graph/newton/newton_agent.hpp"
#include "modules/pose_graph/session_solver.hpp"

namespace km {

/// A session's graph by Newton's method: one NewtonAgent from its start to convergence.
class NewtonSessionSolver final : public SessionSolver {
 public:
  NewtonSessionSolver(RobotEdges edges, std::set<RobotId> members, std::vector<SE3> start,
                      bool upright);

  [[nodiscard]] SolverContent hello() const override { return agent_.hello(); }
  void receive(const SolverMessagePtr& message) override;
  [[nodiscard]] bool ready() const override { return agent_.ready(); }
  [[nodiscard]] std::optional<SolverContent> advance() override;
  [[nodiscard]] bool done() const override { return agent_.done(); }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return agent_.poses(); }
  [[nodiscard]] SolverProgress progress() const override;

 private:
  NewtonAgent agent_;
};

}  // namespace km
