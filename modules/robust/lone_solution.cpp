#include "modules/robust/lone_solution.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "modules/robust/robust_schedule.hpp"
#include "modules/robust/tree_newton.hpp"
#include "modules/tree_newton/chordal.hpp"

namespace km {
namespace {

// The 99.9999 % quantile of the cost of true closures as precise as claimed, by the normal
// approximation. A planar rotation counts twice in the cost (see planar_precision_of()).
double largest_cost(std::ptrdiff_t closures, int dimension) {
  constexpr double kQuantile = 4.75;  // [sigma]
  const double mean = dimension == 2 ? 4.0 : 6.0, variance = 12.0;
  const auto n = static_cast<double>(closures);
  return mean * n + kQuantile * std::sqrt(variance * n);
}

constexpr double kWhole = std::numeric_limits<double>::infinity();

double squared_residual(const PoseEdge& e, const std::vector<SE3>& poses) {
  return std::pow(residual_of(e, poses[e.from.index], poses[e.to.index]), 2);
}

double cost_of(std::span<const PoseEdge> edges, const std::vector<SE3>& poses, double most) {
  double sum = 0.0;
  for (const PoseEdge& e : edges) sum += std::min(squared_residual(e, poses), most);
  return sum;
}

}  // namespace

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

std::optional<std::vector<SE3>> solution_if_all_true(SessionGraph graph,
                                                     TreeNewtonOptions options) try {
  constexpr double kFar = 100.0;  // largest ratio of the cost of the start to that of a solution
  const std::vector<PoseEdge> edges = graph.own;
  const auto closures = edges.begin() + static_cast<std::ptrdiff_t>(graph.odometry);
  const std::ptrdiff_t free =
      edges.end() - closures - std::count_if(edges.begin(), closures, is_unknown_step);
  if (free <= 0) return std::nullopt;
  const double largest = largest_cost(free, options.dimension);
  graph.start = better_of_chordal(std::move(graph.start), edges);
  if (!(cost_of(edges, graph.start, kWhole) <= kFar * largest)) return std::nullopt;
  options.robust = false;
  LoneSolution solution = solve_alone(std::move(graph), options);
  const double barc = default_threshold(options.dimension);
  const bool fit = std::all_of(closures, edges.end(), [&](const PoseEdge& e) {
    return squared_residual(e, solution.poses) <= barc * barc;
  });
  if (!solution.converged || !fit || cost_of(edges, solution.poses, kWhole) > largest)
    return std::nullopt;
  return std::move(solution.poses);
} catch (const std::invalid_argument&) {  // the session will report it
  return std::nullopt;
}

std::optional<DecidedSolution> solution_one_by_one(const SessionGraph& graph,
                                                   TreeNewtonOptions options) try {
  constexpr std::size_t kMost = 100'000;
  constexpr std::uint32_t kRounds = 50;
  const std::span<const PoseEdge> own(graph.own);
  const std::span<const PoseEdge> odometry = own.first(graph.odometry);
  std::vector<PoseEdge> closures(own.begin() + static_cast<std::ptrdiff_t>(graph.odometry),
                                 own.end());
  if (closures.empty() || closures.size() * graph.start.size() > kMost) return std::nullopt;
  std::ranges::stable_sort(closures, {},
                           [](const PoseEdge& e) { return steps_between(e.from, e.to); });
  const LoneSolution weighed = solve_alone(graph, options);
  const double rejected = weighed.barc * weighed.barc;
  options.robust = false;
  options.max_rounds = kRounds;
  SessionGraph trial = graph;
  trial.own.resize(graph.odometry);
  DecidedSolution found{graph.start, {}};
  double cost = 0.0;
  for (int sweep = 0; sweep < 2; ++sweep)
    for (const PoseEdge& closure : closures) {
      if (found.decided[closure.id()]) continue;
      trial.own.push_back(closure);
      LoneSolution next = solve_alone(trial, options);
      const double increased = cost_of(trial.own, next.poses, kWhole);
      if (next.converged && increased - cost < rejected) {
        found.decided[closure.id()] = true;
        cost = increased;
        trial.start = found.poses = std::move(next.poses);
      } else {
        trial.own.pop_back();
      }
    }
  const double total = cost + rejected * static_cast<double>(own.size() - trial.own.size());
  const double other =
      cost_of(odometry, weighed.poses, kWhole) + cost_of(closures, weighed.poses, rejected);
  if (!(total < other)) return std::nullopt;
  return found;
} catch (const std::invalid_argument&) {  // the session will report it
  return std::nullopt;
}

}  // namespace km
