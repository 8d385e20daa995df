#include "modules/pose_graph/lone_solution.hpp"

#include <stdexcept>
#include <utility>

#include "modules/pose_graph/tree_newton.hpp"

namespace km {

namespace {

struct Solved {
  TreeNewton newton;
  bool converged;
};

Solved solve(SessionGraph graph, TreeNewtonOptions options) {
  options.patience_rounds = 8.0;  // small, because no messages are sent
  options.covariances = false;
  const RobotId self = graph.self;
  TreeNewton newton(std::move(graph), TreePlace{.members = {self}, .root = self}, options);
  try {
    while (!newton.done()) (void)newton.advance();
  } catch (const std::runtime_error&) {  // the graph cannot be solved, see MemberSolver::advance()
    return {std::move(newton), false};
  }
  const SolverState state = newton.state();
  const bool converged = !state.failed && state.round + 1 < options.max_rounds;
  return {std::move(newton), converged};
}

}  // namespace

LoneSolution solve_alone(SessionGraph graph, TreeNewtonOptions options) {
  const Solved solved = solve(std::move(graph), options);
  return {solved.newton.poses(), solved.converged};
}

std::vector<SE3> relaxed_start(SessionGraph graph, const std::map<KeyframeId, SE3>& known,
                               const TreeNewtonOptions& options) {
  if (graph.own.size() == graph.odometry) return graph.start;
  for (const PoseEdge& e : std::exchange(graph.between, {})) {
    const auto pose = known.find(e.other(graph.self));
    const auto decided = graph.decided.find(e.id());
    if (pose == known.end() || decided == graph.decided.end() || !decided->second) continue;
    graph.public_poses[pose->first] = pose->second;
    graph.to_absent.push_back(e);
  }
  graph.datum_ties.clear();
  graph.origin = {};
  std::vector<SE3> start = graph.start;
  try {
    const Solved solved = solve(std::move(graph), options);
    return solved.converged ? solved.newton.poses() : start;
  } catch (const std::invalid_argument&) {  // the session will report it
    return start;
  }
}

std::map<ClosureId, bool> decide_alone(SessionGraph graph, TreeNewtonOptions options) {
  if (!options.robust || graph.own.size() == graph.odometry) return {};
  for (auto* const edges : {&graph.between, &graph.to_absent, &graph.datum_ties}) edges->clear();
  graph.public_poses.clear();
  graph.origin = {};
  const std::vector<PoseEdge> closures(
      graph.own.begin() + static_cast<std::ptrdiff_t>(graph.odometry), graph.own.end());
  const Solved solved = solve(std::move(graph), options);
  if (!solved.converged) return {};
  std::map<ClosureId, bool> decided;
  for (const WeighedClosure& closure : solved.newton.verdicts().closures)
    decided[closure.id] = closure.kept;
  // A deferred closure is not weighed, and true if it fits.
  const std::vector<SE3>& poses = solved.newton.poses();
  for (const PoseEdge& e : closures)
    if (const auto decision = decided.find(e.id()); decision != decided.end())
      decision->second |=
          residual_of(e, poses[e.from.index], poses[e.to.index]) <= solved.newton.state().barc;
  return decided;
}

}  // namespace km
