#pragma once

#include <set>
#include <vector>

#include "modules/pose_graph/robust/gnc_agent.hpp"
#include "modules/pose_graph/session_solver.hpp"

namespace km {

/// A session's graph by graduated non-convexity: one GncAgent from its start until all weights are
/// decided and the poses are the optimum of the closures that are kept. Odometry is trusted.
class GncSessionSolver final : public SessionSolver {
 public:
  /// `edges.own` begins with the odometry, one edge per pose but the first.
  GncSessionSolver(RobotEdges edges, std::set<RobotId> members, std::vector<SE3> start,
                   double barc);

  [[nodiscard]] SolverContent hello() const override { return agent_.hello(); }
  void receive(const SolverMessagePtr& message) override;
  [[nodiscard]] bool ready() const override { return agent_.ready(); }
  [[nodiscard]] std::optional<SolverContent> advance() override;
  [[nodiscard]] bool done() const override { return agent_.done(); }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return agent_.poses(); }
  [[nodiscard]] SolverProgress progress() const override;
  [[nodiscard]] ClosureVerdicts verdicts() const override;

 private:
  GncAgent agent_;
};

}  // namespace km
