#include "apps/pgo/pgo_run.hpp"

#include <Eigen/Eigenvalues>
#include <memory>
#include <stdexcept>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/newton/newton_team.hpp"
#include "modules/pose_graph/rounding.hpp"
#include "modules/pose_graph/team/central_team.hpp"
#include "modules/pose_graph/team/gauss_seidel_team.hpp"
#include "modules/pose_graph/team/local_team.hpp"
#include "modules/pose_graph/team/team_staircase.hpp"

namespace km {
namespace {

BlockDescentOptions descent_options(const PgoOptions& options) {
  return {.schedule = options.greedy ? BlockSchedule::kGreedy : BlockSchedule::kColoured,
          .max_over_relaxation = options.over_relaxation,
          .accelerated = options.method == SolveMethod::kRbcdAccelerated};
}

AsynchronousOptions asynchronous_options(const PgoOptions& options) {
  AsynchronousOptions result = options.asynchronous;
  result.max_over_relaxation = options.over_relaxation;
  return result;
}

std::unique_ptr<TeamSolver> make_solver(const TeamGraph& graph, const std::vector<SE3>& start,
                                        const PgoOptions& options) {
  switch (options.method) {
    case SolveMethod::kLocal:
      return std::make_unique<LocalTeam>(graph);
    case SolveMethod::kDgs:
      return std::make_unique<GaussSeidelTeam>(graph, start);
    case SolveMethod::kRbcd:
    case SolveMethod::kRbcdAccelerated:
      return std::make_unique<BlockDescentTeam>(graph, lift(start, options.rank),
                                                descent_options(options));
    case SolveMethod::kRbcdAsynchronous:
      return std::make_unique<AsynchronousTeam>(graph, lift(start, options.rank),
                                                asynchronous_options(options));
    case SolveMethod::kCentralized:
      return std::make_unique<CentralTeam>(graph, lift(start, 3));
    case SolveMethod::kNewton:
      return std::make_unique<NewtonTeam>(
          graph, options.rank, options.own_start ? LiftedPoses() : lift(start, options.rank),
          NewtonOptions{});
  }
  throw std::invalid_argument("unknown method");
}

Eigen::Index numerical_rank(const LiftedPoses& X, int dimension) {
  constexpr double kRelative = 1e-3;  // of singular values
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(X.rows(), X.rows());
  for (Eigen::Index i = 0; i < pose_count(X); ++i)
    gram += X.middleCols<3>(4 * i) * X.middleCols<3>(4 * i).transpose();
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram).eigenvalues();
  const double least = kRelative * kRelative * values.maxCoeff();
  return (values.array() > least).count() - (dimension == 2 ? 1 : 0);
}

double optimum_of(const TeamGraph& graph, const std::vector<SE3>& start) {
  Staircase staircase(graph.edges, lift(start, 3), {}, graph.verticals);
  while (staircase.step()) {
  }
  return staircase.cost();
}

// What knows of nothing but edges says so.
void check_verticals(const TeamGraph& graph, const PgoOptions& options) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(what + ", and the graph has " +
                                std::to_string(graph.verticals.size()) +
                                ": leave them out by --no-vertical");
  };
  if (graph.verticals.empty()) return;
  if (options.method == SolveMethod::kDgs || options.method == SolveMethod::kRbcdAsynchronous)
    refuse(std::string("method ") + to_string(options.method) + " does not know verticals");
  if (options.verify) refuse("the team's own verification (--verify) does not know verticals");
  if (options.own_start) refuse("the team's own start (--own-start) does not know verticals");
}

// The frame of the first pose; with verticals, that turned the least so that z is up.
Eigen::MatrixXd world_of(const TeamGraph& graph, const LiftedPoses& X) {
  if (graph.verticals.empty()) return X.leftCols<4>();
  return level(X.leftCols<4>(), Eigen::Vector3d::Zero());
}

// The method's own part of the run: rounds, poses, and what it has verified itself.
void solve(const TeamGraph& graph, const std::vector<SE3>& start, const PgoOptions& options,
           const TeamMeter& meter, PgoRun& run) {
  if (options.verify) {
    constexpr Eigen::Index kMaxRank = 10;
    TeamStaircase staircase = run_team_staircase(
        graph, lift(start, options.rank), descent_options(options), options.run, kMaxRank, meter);
    run.rounds = std::move(staircase.rounds);
    run.X = std::move(staircase.X);
    run.verification = std::move(staircase.verification);
    return;
  }
  const auto solver = make_solver(graph, start, options);
  run.rounds = run_team(graph, *solver, options.run, meter);
  run.X = team_poses(graph, *solver);
}

}  // namespace

const char* to_string(SolveMethod method) {
  switch (method) {
    case SolveMethod::kLocal:
      return "local";
    case SolveMethod::kDgs:
      return "dgs";
    case SolveMethod::kRbcd:
      return "rbcd";
    case SolveMethod::kRbcdAccelerated:
      return "rbcd-accelerated";
    case SolveMethod::kRbcdAsynchronous:
      return "rbcd-asynchronous";
    case SolveMethod::kCentralized:
      return "centralized";
    case SolveMethod::kNewton:
      return "newton";
  }
  return "?";
}

PgoRun run_pgo(const TeamGraph& graph, const PgoOptions& options, const TeamMeter& meter) {
  PgoRun run;
  check_verticals(graph, options);
  run.method = options.method;
  const double begin_s = meter.cpu_s();
  const std::vector<SE3> start =
      levelled(chordal_initialisation(graph.poses(), graph.edges), graph.verticals);
  run.start_s = meter.cpu_s() - begin_s;
  solve(graph, start, options, meter, run);
  run.certificate = certify(problem_of(graph, run.X.rows()), run.X);
  run.rank = numerical_rank(run.X, graph.dimension);
  run.T_world_kf = round_to_poses(run.X, world_of(graph, run.X));
  run.rounded_cost = problem_of(graph, 3).cost(lift(run.T_world_kf, 3));
  run.optimum = options.optimum ? *options.optimum : optimum_of(graph, start);
  return run;
}

}  // namespace km
