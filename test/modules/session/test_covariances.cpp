#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/symmetric_eigen.hpp"
#include "modules/robust/tree_newton.hpp"
#include "modules/tree_newton/edge_model.hpp"
#include "test/support/solver_team.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Small enough that the second derivatives of the start are those of the optimum.
constexpr double kSmall = 2e-5;  // [rad, m]

auto newton(const TreeNewtonOptions& options) {
  return [options](SessionGraph graph, TreePlace place) {
    return std::make_unique<TreeNewton>(std::move(graph), std::move(place), options);
  };
}

// The poses of all members, one after the other.
struct Stacked {
  std::map<RobotId, Index> first;
  std::vector<SE3> poses;

  explicit Stacked(const TeamPoses& team) {
    for (const auto& [robot, of_robot] : team) {
      first[robot] = static_cast<Index>(poses.size());
      poses.insert(poses.end(), of_robot.begin(), of_robot.end());
    }
  }
  [[nodiscard]] Index rows() const { return 6 * static_cast<Index>(poses.size()); }
};

// Second derivatives of the whole cost. Poses of absent robots are held.
MatrixXd hessian(const TeamProblem& problem, const Stacked& team) {
  MatrixXd H = MatrixXd::Zero(team.rows(), team.rows());
  const auto node = [&](const KeyframeId& id) {
    return team.first.contains(id.robot) ? 6 * (team.first.at(id.robot) + id.index) : -1;
  };
  const auto pose = [&](const KeyframeId& id) {
    return team.first.contains(id.robot)
               ? team.poses[static_cast<std::size_t>(team.first.at(id.robot) + id.index)]
               : problem.start.at(id.robot)[id.index];
  };
  for (const PoseEdge& e : problem.edges) {
    const Index i = node(e.from), j = node(e.to);
    const EdgeModel model =
        model_edge(e.T_from_to, e.precision, pose(e.from), pose(e.to), Curvature::kGaussNewton);
    if (i >= 0) H.block<6, 6>(i, i) += model.H_ii;
    if (j >= 0) H.block<6, 6>(j, j) += model.H_jj;
    if (i < 0 || j < 0) continue;
    H.block<6, 6>(i, j) += model.H_ij;
    H.block<6, 6>(j, i) += model.H_ij.transpose();
  }
  for (const auto& [robot, priors] : problem.verticals)
    for (const VerticalPrior& v : priors) {
      const Index k = team.first.at(robot) + v.pose;
      H.block<3, 3>(6 * k, 6 * k) +=
          model_vertical(v, team.poses[static_cast<std::size_t>(k)].linear(),
                         Curvature::kGaussNewton)
              .H;
    }
  return H;
}

// Twice the pseudoinverse of H, which leaves out the common motions of the team.
MatrixXd covariance_of_all(const MatrixXd& H) {
  const SymmetricEigen eigen = symmetric_eigen(H);
  const double least = 1e-9 * eigen.values.maxCoeff();
  const Eigen::VectorXd inverse =
      eigen.values.unaryExpr([&](double x) { return x > least ? 2.0 / x : 0.0; });
  return eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
}

// Subtracts from the error of every pose the common motion that carries the first pose to its
// estimate. `upright`: this motion is a rotation about z and a translation.
MatrixXd relative_to_first(const Stacked& team, bool upright) {
  const SE3& T = team.poses.front();
  MatrixXd relative = MatrixXd::Identity(team.rows(), team.rows());
  for (std::size_t k = 0; k < team.poses.size(); ++k)
    for (Index c = 0; c < 6; ++c) {
      const Vector6 xi = Vector6::Unit(c);
      Eigen::Vector3d w = T.linear() * xi.head<3>();
      if (upright) w.head<2>().setZero();
      const Eigen::Vector3d u = T.linear() * xi.tail<3>();  // motion of the first position
      const Eigen::Matrix3d R_t = team.poses[k].linear().transpose();
      const Eigen::Vector3d lever = team.poses[k].translation() - T.translation();
      const Index row = 6 * static_cast<Index>(k);
      relative.block<3, 1>(row, c) -= R_t * w;
      relative.block<3, 1>(row + 3, c) -= R_t * (u + w.cross(lever));
    }
  return relative;
}

// The default allows for the rounding of correlations in messages, 1.6e-5 each, relative to the
// largest covariance.
void check_against(const MatrixXd& expected, const Stacked& stacked, SolverTeam& team,
                   double tolerance = 5e-5) {
  for (const auto& [robot, first] : stacked.first) {
    const std::vector<Matrix6> covariances = team.member(robot).covariances();
    REQUIRE(covariances.size() == team.member(robot).poses().size());
    for (std::size_t k = 0; k < covariances.size(); ++k) {
      const Index row = 6 * (first + static_cast<Index>(k));
      CAPTURE(robot, k);
      const Matrix6 difference = covariances[k] - expected.block<6, 6>(row, row);
      CHECK(difference.norm() / expected.norm() < tolerance);
    }
  }
}

TEST_CASE("Covariances equal those of the dense inverse, with any tree") {
  const double tilt_sigma = GENERATE(0.0, kSmall);
  CAPTURE(tilt_sigma);
  const TeamProblem problem =
      random_team_problem({.robots = {0, 2, 5, 7},
                           .pairs = {{0, 2}, {2, 5}, {5, 7}, {0, 7}, {0, 5}},
                           .sigma = kSmall,
                           .start_sigma = kSmall,
                           .tilt_sigma = tilt_sigma},
                          3);
  const auto trees = {star(problem.members()), star(problem.members(), 2),
                      chain(problem.members())};
  for (const TeamTree& tree : trees) {
    SolverTeam team = solver_team(problem, tree, {}, newton({.robust = false}));
    REQUIRE(team.run());
    const Stacked stacked(team.poses());
    const MatrixXd relative = relative_to_first(stacked, tilt_sigma > 0.0);
    const MatrixXd P = covariance_of_all(hessian(problem, stacked));
    check_against(relative * P * relative.transpose(), stacked, team);
  }
}

TEST_CASE("Held poses of absent robots make covariances absolute") {
  TeamProblem problem = random_team_problem({.robots = {1, 2, 3},
                                             .pairs = {{1, 2}, {2, 3}, {1, 3}},
                                             .sigma = kSmall,
                                             .start_sigma = kSmall},
                                            5);
  problem.absent = {2};
  SolverTeam team = solver_team(problem, chain(problem.members()), {}, newton({.robust = false}));
  REQUIRE(team.run());
  const Stacked stacked(team.poses());
  check_against(2.0 * hessian(problem, stacked).inverse(), stacked, team);
}

TEST_CASE("Errors of the poses are as large as their covariances say") {
  double sum = 0.0, count = 0.0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const TeamProblem problem =
        random_team_problem({.robots = {1, 2, 3}, .pairs = {{1, 2}, {2, 3}, {1, 3}}}, seed);
    SolverTeam team = solver_team(problem, chain(problem.members()), {}, newton({.robust = false}));
    REQUIRE(team.run());
    const TeamPoses poses = team.poses();
    const SE3 T_true_estimated = problem.truth.at(1)[0] * poses.at(1)[0].inverse();
    for (const auto& [robot, of_robot] : poses)
      for (std::size_t k = robot == 1 ? 1 : 0; k < of_robot.size(); ++k) {
        const Vector6 xi =
            se3_log((T_true_estimated * of_robot[k]).inverse() * problem.truth.at(robot)[k]);
        sum += xi.dot(team.member(robot).covariances()[k].llt().solve(xi)) / 6.0;
        count += 1.0;
      }
  }
  // Poses of one team are correlated: 40 teams with some ten independent poses each.
  CHECK(sum / count == Approx(1.0).margin(0.1));
}

// Five closures inside robot 2 from keyframes 3 to 7 to a place 50 m off. They agree with each
// other up to `spread_m`.
void add_false_closures(TeamProblem& problem, double spread_m, std::mt19937& rng) {
  const std::vector<SE3>& truth = problem.truth.at(2);
  for (std::uint32_t k = 3; k < 8; ++k) {
    SE3 T = truth[k].inverse() * truth[k + 10];
    T.translation() += Eigen::Vector3d(50.0, 0.0, 0.0) + spread_m * random_vector<3>(rng);
    problem.edges.push_back({{2, k}, {2, k + 10}, T, problem.edges.front().precision});
  }
  problem.edges = in_order(problem.edges);
}

TEST_CASE("Rejected closures that agree roughly do not increase the covariances") {
  TeamProblem problem = random_team_problem({.robots = {1, 2}, .pairs = {{1, 2}}}, 8);
  std::erase_if(problem.edges,
                [](const PoseEdge& e) { return e.from.robot == e.to.robot && !is_step(e); });
  SolverTeam honest = solver_team(problem, star(problem.members()), {}, newton({.robust = false}));
  std::mt19937 rng(9);
  add_false_closures(problem, 0.8, rng);  // 40 times the standard deviation
  SolverTeam team = solver_team(problem, star(problem.members()), {}, newton({}));
  REQUIRE(honest.run());
  REQUIRE(team.run());
  std::size_t rejected = 0;
  for (const RobotId robot : problem.members())
    rejected += team.member(robot).verdicts().rejected();
  CHECK(rejected == 5);
  const double expected = honest.member(2).covariances().back().trace();
  CHECK(team.member(2).covariances().back().trace() > 0.5 * expected);
  CHECK(team.member(2).covariances().back().trace() < 3.0 * expected);
}

}  // namespace
}  // namespace km
