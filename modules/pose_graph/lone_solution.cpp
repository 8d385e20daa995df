#include "modules/pose_graph/lone_solution.hpp"

#include <algorithm>
#include <ranges>
#include <span>
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

std::vector<PoseEdge> closures_inside(const SessionGraph& graph) {
  return {graph.own.begin() + static_cast<std::ptrdiff_t>(graph.odometry), graph.own.end()};
}

// A deferred closure is not weighed, and true if it fits.
std::map<ClosureId, bool> decisions_on(std::span<const PoseEdge> closures,
                                       const TreeNewton& newton) {
  std::map<ClosureId, bool> decided;
  for (const WeighedClosure& closure : newton.verdicts().closures)
    decided[closure.id] = closure.kept;
  const std::vector<SE3>& poses = newton.poses();
  for (const PoseEdge& e : closures)
    if (const auto decision = decided.find(e.id()); decision != decided.end())
      decision->second |=
          residual_of(e, poses[e.from.index], poses[e.to.index]) <= newton.state().barc;
  return decided;
}

// If many closures are false, a robot alone decides worse than a team. With 10 % of false
// closures in parking-garage, a false one would be kept (RMSE 2.5 m).
bool mostly_kept(const std::map<ClosureId, bool>& decided) {
  constexpr double kMostRejected = 0.03;
  const auto rejected = std::ranges::count(decided | std::views::values, false);
  return static_cast<double>(rejected) <= kMostRejected * static_cast<double>(decided.size());
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
  const std::vector<PoseEdge> closures = closures_inside(graph);
  try {
    const Solved solved = solve(std::move(graph), options);
    const bool clear = solved.converged && mostly_kept(decisions_on(closures, solved.newton));
    return clear ? solved.newton.poses() : start;
  } catch (const std::invalid_argument&) {  // the session will report it
    return start;
  }
}

std::map<ClosureId, bool> decide_alone(SessionGraph graph, TreeNewtonOptions options) {
  if (!options.robust || graph.own.size() == graph.odometry) return {};
  for (auto* const edges : {&graph.between, &graph.to_absent, &graph.datum_ties}) edges->clear();
  graph.public_poses.clear();
  graph.origin = {};
  const std::vector<PoseEdge> closures = closures_inside(graph);
  const Solved solved = solve(std::move(graph), options);
  if (!solved.converged) return {};
  std::map<ClosureId, bool> decided = decisions_on(closures, solved.newton);
  if (mostly_kept(decided)) return decided;
  decided.clear();
  return decided;
}

}  // namespace km
