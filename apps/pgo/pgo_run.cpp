#include "apps/pgo/pgo_run.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <memory>
#include <stdexcept>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/newton/newton_team.hpp"
#include "modules/pose_graph/rounding.hpp"
#include "modules/pose_graph/team/block_descent_team.hpp"
#include "modules/pose_graph/team/central_team.hpp"
#include "modules/pose_graph/team/gauss_seidel_team.hpp"
#include "modules/pose_graph/team/local_team.hpp"

namespace km {
namespace {

std::unique_ptr<TeamSolver> make_solver(const TeamGraph& graph, const std::vector<SE3>& start,
                                        const PgoOptions& options) {
  BlockDescentOptions descent{.max_over_relaxation = options.over_relaxation};
  if (options.greedy) descent.schedule = BlockSchedule::kGreedy;
  switch (options.method) {
    case PgoMethod::kLocal:
      return std::make_unique<LocalTeam>(graph);
    case PgoMethod::kDgs:
      return std::make_unique<GaussSeidelTeam>(graph, start);
    case PgoMethod::kRbcdAccelerated:
      descent.accelerated = true;
      [[fallthrough]];
    case PgoMethod::kRbcd:
      return std::make_unique<BlockDescentTeam>(graph, lift(start, options.rank), descent);
    case PgoMethod::kCentralized:
      return std::make_unique<CentralTeam>(graph, lift(start, 3));
    case PgoMethod::kNewton:
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
  Staircase staircase(graph.edges, lift(start, 3));
  while (staircase.step()) {
  }
  return staircase.cost();
}

}  // namespace

const char* to_string(PgoMethod method) {
  switch (method) {
    case PgoMethod::kLocal:
      return "local";
    case PgoMethod::kDgs:
      return "dgs";
    case PgoMethod::kRbcd:
      return "rbcd";
    case PgoMethod::kRbcdAccelerated:
      return "rbcd-accelerated";
    case PgoMethod::kCentralized:
      return "centralized";
    case PgoMethod::kNewton:
      return "newton";
  }
  return "?";
}

PgoRun run_pgo(const TeamGraph& graph, const PgoOptions& options, const TeamMeter& meter) {
  const std::vector<SE3> start = chordal_initialisation(graph.poses(), graph.edges);
  const auto solver = make_solver(graph, start, options);
  PgoRun run;
  run.method = options.method;
  run.rounds = run_team(graph, *solver, options.run, meter);
  run.X = team_poses(graph, *solver);
  const QuadraticProblem whole(run.X.rows(), graph.poses(), graph.edges, {});
  const auto* central = dynamic_cast<const CentralTeam*>(solver.get());
  const bool known = central != nullptr && central->staircase().certificate();
  run.certificate = known ? *central->staircase().certificate() : certify(whole, run.X);
  run.rank = numerical_rank(run.X, graph.dimension);
  run.T_world_kf = round_to_poses(run.X, run.X.leftCols<4>());
  run.rounded_cost =
      QuadraticProblem(3, graph.poses(), graph.edges, {}).cost(lift(run.T_world_kf, 3));
  if (options.optimum)
    run.optimum = *options.optimum;
  else
    run.optimum = std::min(optimum_of(graph, start), known ? run.rounds.back().cost : 1e300);
  return run;
}

}  // namespace km
