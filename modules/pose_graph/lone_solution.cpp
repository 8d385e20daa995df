#include "modules/pose_graph/lone_solution.hpp"

#include <stdexcept>
#include <utility>

#include "modules/pose_graph/tree_newton.hpp"

namespace km {

LoneSolution solve_alone(SessionGraph graph, TreeNewtonOptions options) {
  options.patience_rounds = 8.0;  // small, because no messages are sent
  options.covariances = false;
  const RobotId self = graph.self;
  TreeNewton newton(std::move(graph), TreePlace{.members = {self}, .root = self}, options);
  try {
    while (!newton.done()) (void)newton.advance();
  } catch (const std::runtime_error&) {  // the graph cannot be solved, see MemberSolver::advance()
    return {newton.poses(), 0.0, false};
  }
  const SolverState state = newton.state();
  return {newton.poses(), state.barc, !state.failed && state.round + 1 < options.max_rounds};
}

std::vector<SE3> relaxed_start(SessionGraph graph, const TreeNewtonOptions& options) {
  std::vector<SE3> start = graph.start;
  std::vector<PoseEdge> closures;
  for (std::size_t k = graph.odometry; k < graph.own.size(); ++k) {
    const auto decided = graph.decided.find(graph.own[k].id());
    if (decided == graph.decided.end() || decided->second) closures.push_back(graph.own[k]);
  }
  if (closures.empty()) return start;
  try {
    LoneSolution solution = solve_alone(std::move(graph), options);
    const bool clear = solution.converged && mostly_fit(closures, solution.poses, solution.barc);
    return clear ? std::move(solution.poses) : start;
  } catch (const std::invalid_argument&) {  // the session will report it
    return start;
  }
}

}  // namespace km
