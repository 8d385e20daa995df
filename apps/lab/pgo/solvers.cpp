#include "apps/lab/pgo/solvers.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "apps/lab/pgo/agent_team.hpp"
#include "apps/lab/pgo/central_solver.hpp"
#include "apps/lab/pgo/local_team.hpp"
#include "modules/core/symmetric_eigen.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "modules/rbcd/stiefel.hpp"
#include "modules/robust/tree_newton.hpp"
#include "modules/tree_newton/chordal.hpp"

namespace km {
namespace {

constexpr Eigen::Index kRigidRank = 3;

// The whole graph on one computer, see CentralSolver. A round is one of its steps, and all work
// counts for robot 0. The bytes for collecting the measurements are not counted.
class CentralTeam : public TeamSolver {
 public:
  CentralTeam(const TeamGraph& graph, const std::vector<SE3>& start)
      : first_(graph.first),
        solver_(graph.edges, lift(start, kRigidRank), graph.dimension, graph.verticals),
        blocks_(graph.robots()) {
    copy_blocks();
  }

  int step(RoundMeter& meter) override {
    const bool stepped = meter.run(0, [&] { return solver_.step(); });
    copy_blocks();
    return stepped ? 1 : 0;
  }
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }

 private:
  void copy_blocks() {
    for (std::size_t k = 0; k < blocks_.size(); ++k)
      blocks_[k] = solver_.X().middleCols(4 * first_[k], 4 * (first_[k + 1] - first_[k]));
  }

  std::vector<Eigen::Index> first_;
  CentralSolver solver_;
  std::vector<LiftedPoses> blocks_;
};

// The robots' own block descent, with their own stopping rule.
std::unique_ptr<TeamSolver> rbcd_team(const TeamGraph& graph, const std::vector<SE3>& start,
                                      const SolverOptions& options) {
  const RbcdOptions rbcd{.max_rounds = static_cast<std::uint32_t>(options.run.max_rounds),
                         .max_over_relaxation = options.over_relaxation};
  return std::make_unique<MemberTeam>(
      graph, kRigidRank, start, [rbcd](SessionGraph part, const TreePlace& place) {
        return std::make_unique<MemberRbcd>(std::move(part), place, rbcd);
      });
}

std::unique_ptr<TeamSolver> make_team(const TeamGraph& graph, const std::vector<SE3>& start,
                                      const SolverOptions& options) {
  const std::string& method = options.method;
  if (method == "local") return std::make_unique<LocalTeam>(graph);
  if (method == "rbcd") return rbcd_team(graph, start, options);
  if (method == "centralized") return std::make_unique<CentralTeam>(graph, start);
  throw std::invalid_argument("unknown method " + method);
}

// The members of one session that trust all closures. No gradient tolerance ends the run.
SolverRun run_trusting(const TeamGraph& graph, const std::vector<SE3>& start,
                       const SolverOptions& options, const TeamMeter& meter) {
  TreeNewtonOptions newton = newton_options({.robust = false});
  newton.dimension = graph.dimension;
  newton.absolute_tolerance = 1e-12;
  MemberTeam team(graph, kRigidRank, start, [&](SessionGraph part, TreePlace place) {
    return std::make_unique<TreeNewton>(std::move(part), std::move(place), newton);
  });
  SolverRun run;
  run.rounds = run_team(graph, team,
                        {.max_rounds = options.run.max_rounds, .gradient_tolerance = -1.0}, meter);
  run.X = team_poses(graph, team);
  return run;
}

// The robots' own code from measurements to published poses, over an ideal network.
SolverRun run_agents(const TeamGraph& graph, const SolverOptions& options, const TeamMeter& meter) {
  AgentTeamOptions team{.meter = meter};
  team.pose_graph.max_rounds = options.run.max_rounds;
  team.pcm.witness_wait_s = 0.0;
  AgentTeamRun robots = run_agent_team(graph, team);
  TeamRound end{.round = static_cast<int>(robots.last.round),
                .cost = robots.last.cost,
                .gradient_norm = robots.last.gradient,
                .work = {.bytes = robots.bytes, .critical_path_s = robots.critical_path_s}};
  Decision decision{.kept = std::move(robots.kept),
                    .noise_scale = robots.last.noise_scale,
                    .threshold = robots.last.barc,
                    .decided = robots.settled && end.round < options.run.max_rounds};
  const auto bytes = [](const std::array<std::size_t, 4>& by_kind) {
    return std::accumulate(by_kind.begin(), by_kind.end(), std::size_t{0});
  };
  for (const AgentCost& cost : robots.costs) {
    end.work.total_cpu_s += cost.cpu_s;
    decision.most_sent = std::max(decision.most_sent, bytes(cost.sent));
    decision.most_received = std::max(decision.most_received, bytes(cost.received));
  }
  return {{end}, lift(robots.T_world_kf, kRigidRank), std::move(decision)};
}

}  // namespace

SolverRun run_solver(const TeamGraph& graph, const std::vector<SE3>& start,
                     const SolverOptions& options, const TeamMeter& meter) {
  if (options.rejects()) return run_agents(graph, options, meter);
  if (options.method == "newton") return run_trusting(graph, start, options, meter);
  const auto team = make_team(graph, start, options);
  SolverRun run;
  run.rounds = run_team(graph, *team, options.run, meter);
  run.X = team_poses(graph, *team);
  return run;
}

CentralOptimum central_optimum(const TeamGraph& graph, const std::vector<SE3>& start) {
  CentralSolver solver(graph.edges, lift(start, kRigidRank), graph.dimension, graph.verticals);
  while (solver.step()) {
  }
  return {solver.X(), solver.cost(), solver.certificate() && solver.certificate()->certified};
}

CentralOptimum central_optimum(const TeamGraph& graph) {
  return central_optimum(
      graph, levelled(chordal_initialisation(graph.poses(), graph.edges), graph.verticals));
}

TeamMeter cpu_meter() {
  return {.cpu_s = thread_cpu_s};
}

namespace {

Eigen::Index numerical_rank(const LiftedPoses& X, int dimension) {
  constexpr double kRelative = 1e-3;  // relative to the largest singular value
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(X.rows(), X.rows());
  for (Eigen::Index i = 0; i < pose_count(X); ++i)
    gram += X.middleCols<3>(4 * i) * X.middleCols<3>(4 * i).transpose();
  const Eigen::VectorXd values = symmetric_eigen(gram).values;
  const double least = kRelative * kRelative * values.maxCoeff();
  return (values.array() > least).count() - (dimension == 2 ? 1 : 0);
}

// The frame of the first pose. With verticals, it is rotated by the smallest angle so that z is up.
Eigen::MatrixXd world_of(const TeamGraph& graph, const LiftedPoses& X) {
  if (graph.verticals.empty()) return X.leftCols<4>();
  return level(X.leftCols<4>(), Eigen::Vector3d::Zero());
}

}  // namespace

Solution solve(const TeamGraph& graph, const SolverOptions& options, const TeamMeter& meter) {
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
  const CentralOptimum least = central_optimum(graph, start);
  solution.comparison =
      OptimumComparison{.rounded_cost = problem_of(graph, 3).cost(lift(solution.T_world_kf, 3)),
                        .optimum = least.cost,
                        .optimum_certified = least.certified,
                        .certificate = certify(problem_of(graph, X.rows()), X),
                        .rank = numerical_rank(X, graph.dimension)};
  return solution;
}

}  // namespace km
