#include "apps/lab/pgo/team_solver.hpp"

#include <optional>

namespace km {

LiftedPoses team_poses(const TeamGraph& graph, const TeamSolver& solver) {
  LiftedPoses X(solver.block(0).rows(), 4 * graph.poses());
  for (std::size_t k = 0; k < graph.robots(); ++k)
    X.middleCols(4 * graph.first[k], 4 * graph.poses_of(k)) = solver.block(k);
  return X;
}

std::vector<TeamRound> run_team(const TeamGraph& graph, TeamSolver& solver,
                                const TeamRunOptions& options, const TeamMeter& meter) {
  std::optional<QuadraticProblem> whole;
  RoundMeter round_meter(graph.robots(), meter);
  std::vector<TeamRound> rounds;
  TeamWork work;
  int round = 0;
  const auto record = [&] {
    const LiftedPoses X = team_poses(graph, solver);
    if (!whole || whole->rank() != X.rows()) whole.emplace(problem_of(graph, X.rows()));
    const double gradient_norm = project_tangent(X, whole->euclidean_gradient(X)).norm();
    rounds.push_back({round, whole->cost(X), gradient_norm, work});
    return gradient_norm > options.gradient_tolerance;
  };
  bool going = record();
  while (going && round < options.max_rounds) {
    const int made = solver.step(round_meter);
    if (made == 0) break;
    round += made;
    work += round_meter.finish_round();
    going = record();
  }
  return rounds;
}

}  // namespace km
