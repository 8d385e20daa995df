#include "apps/pgo/solution.hpp"

#include <Eigen/Eigenvalues>

#include "modules/pgo_study/central_solver.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/rounding.hpp"

namespace km {
namespace {

Eigen::Index numerical_rank(const LiftedPoses& X, int dimension) {
  constexpr double kRelative = 1e-3;  // of singular values
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(X.rows(), X.rows());
  for (Eigen::Index i = 0; i < pose_count(X); ++i)
    gram += X.middleCols<3>(4 * i) * X.middleCols<3>(4 * i).transpose();
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram).eigenvalues();
  const double least = kRelative * kRelative * values.maxCoeff();
  return (values.array() > least).count() - (dimension == 2 ? 1 : 0);
}

struct Optimum {
  double cost = 0.0;
  bool certified = false;
};

Optimum optimum_of(const TeamGraph& graph, const std::vector<SE3>& start) {
  CentralSolver solver(graph.edges, lift(start, 3), graph.dimension, {}, graph.verticals);
  while (solver.step()) {
  }
  return {solver.cost(), solver.certificate() && solver.certificate()->certified};
}

// The frame of the first pose; with verticals, that turned the least so that z is up.
Eigen::MatrixXd world_of(const TeamGraph& graph, const LiftedPoses& X) {
  if (graph.verticals.empty()) return X.leftCols<4>();
  return level(X.leftCols<4>(), Eigen::Vector3d::Zero());
}

}  // namespace

Solution solve(const TeamGraph& graph, const SolverOptions& options, std::optional<double> optimum,
               const TeamMeter& meter) {
  Solution solution{.method = options.name()};
  std::vector<SE3> start;
  if (!options.rejects()) {
    const double begin_s = meter.cpu_s();
    start = levelled(chordal_initialisation(graph.poses(), graph.edges), graph.verticals);
    solution.start_s = meter.cpu_s() - begin_s;
  }
  solution.run = run_solver(graph, start, options, meter);
  const LiftedPoses& X = solution.run.X;
  solution.T_world_kf = round_to_poses(X, world_of(graph, X));
  if (options.rejects()) return solution;
  const Optimum least = optimum ? Optimum{*optimum, true} : optimum_of(graph, start);
  solution.judgement =
      Judgement{.rounded_cost = problem_of(graph, 3).cost(lift(solution.T_world_kf, 3)),
                .optimum = least.cost,
                .optimum_certified = least.certified,
                .certificate = certify(problem_of(graph, X.rows()), X),
                .rank = numerical_rank(X, graph.dimension)};
  return solution;
}

}  // namespace km
