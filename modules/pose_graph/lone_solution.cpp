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
    return {newton.poses(), false};
  }
  const SolverState state = newton.state();
  return {newton.poses(), !state.failed && state.round + 1 < options.max_rounds};
}

}  // namespace km
