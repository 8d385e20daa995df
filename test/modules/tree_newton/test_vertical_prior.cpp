#include "modules/core/geometry/lie.hpp"
#include "modules/rbcd/stiefel.hpp"
#include "modules/tree_newton/edge_model.hpp"
#include "modules/tree_newton/vertical_prior.hpp"
#include "test/support/pose_graph_problems.hpp"
#include "test/support/test.hpp"

// Verticals in pose graph optimisation.

namespace km {
namespace {

constexpr double kWeight = 1.0 / (0.005 * 0.005);

Eigen::Vector3d up_at(const SE3& T_world_kf) {
  return T_world_kf.linear().transpose() * Eigen::Vector3d::UnitZ();
}

}  // namespace

TEST_CASE(
    "a vertical prior costs the squared tilt over sigma, and rotations about z cost nothing") {
  const double tilt = GENERATE(0.0, 1e-3, 2e-2);
  const double heading = GENERATE(0.0, 1.0, -3.0);
  const VerticalPrior prior{0, Eigen::Vector3d::UnitZ(), kWeight};
  const Eigen::Matrix3d R = so3_exp({0.0, 0.0, heading}) * so3_exp({tilt, 0.0, 0.0});
  const double expected = tilt * tilt * kWeight;
  CHECK(vertical_cost(prior, R) == Approx(expected).epsilon(1e-3).margin(1e-9));
  Eigen::MatrixXd lifted = lifting_matrix(5) * R;
  CHECK(vertical_cost(prior, lifted) == Approx(vertical_cost(prior, R)).margin(1e-9));
}

TEST_CASE("gradient and Hessian of a vertical prior agree with finite differences") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Eigen::Matrix3d R = random_pose(rng).linear();
  const VerticalPrior prior{0, random_vector<3>(rng).normalized(), 1.7};
  const VerticalModel model = model_vertical(prior, R, Curvature::kFull);
  const auto cost = [&](const Eigen::Vector3d& w) { return vertical_cost(prior, R * so3_exp(w)); };
  CHECK(model.cost == Approx(cost(Eigen::Vector3d::Zero())));
  constexpr double h = 1e-4;
  for (int k = 0; k < 10; ++k) {
    const Eigen::Vector3d d = random_vector<3>(rng);
    const double up = cost(h * d);
    const double down = cost(-h * d);
    CHECK((up - down) / (2.0 * h) == Approx(model.g.dot(d)).margin(1e-5));
    CHECK((up - 2.0 * model.cost + down) / (h * h) == Approx(d.dot(model.H * d)).margin(1e-4));
  }
  const VerticalModel convex = model_vertical(prior, R, Curvature::kGaussNewton);
  CHECK(convex.g == model.g);
  CHECK((convex.H * R.row(2).transpose()).norm() <
        1e-12);  // rotations about the vertical cost nothing
}

TEST_CASE("poses are levelled as a whole, by the vertical of most of their priors") {
  std::mt19937 rng(3);
  const SE3 tilt = make_pose(so3_exp({1.0, 0.4, 0.0}), Eigen::Vector3d::Zero());
  std::vector<SE3> poses;
  std::vector<VerticalPrior> priors;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const SE3 upright = random_pose(rng);
    poses.push_back(tilt * upright);
    if (i % 2 == 0) priors.push_back({i, up_at(upright), 1.0 + static_cast<double>(i)});
  }
  CHECK(levelled(poses, {}).front().isApprox(poses.front(), 0.0));
  const std::vector<SE3> level = levelled(poses, priors);
  for (const VerticalPrior& prior : priors)
    CHECK(vertical_cost(prior, level[static_cast<std::size_t>(prior.pose)].linear()) < 1e-12);
  for (std::size_t i = 1; i < poses.size(); ++i)
    CHECK((level[0].inverse() * level[i]).isApprox(poses[0].inverse() * poses[i], 1e-12));
  priors.push_back({1, -up_at(tilt.inverse() * poses[1]), 0.5});  // in a minority
  CHECK(levelled(poses, priors)[0].isApprox(level[0], 1e-12));
}

TEST_CASE("levelling keeps the position of the origin and the heading") {
  const Eigen::Vector3d origin(1.0, 2.0, 3.0);
  const SE3 truth = make_pose(so3_exp({0.0, 0.0, 0.7}), {4.0, -1.0, 0.5});
  SE3 tilted = truth;
  tilted.linear() = so3_exp({0.02, -0.01, 0.0}) * truth.linear();
  tilted.translation() += (truth.linear() - tilted.linear()) * origin;
  const Eigen::MatrixXd L = level(lift(lifted_identity(5), tilted), origin);
  CHECK(L.isApprox(lift(lifted_identity(5), truth), 1e-4));  // error of second order in the tilt
  CHECK(stiefel_error(L) < 1e-12);
  CHECK((L.col(2) - lifting_matrix(5).col(2)).norm() < 1e-15);
}

TEST_CASE("levelling rotates a frame that lies on its side, and one upside down") {
  const auto roll = GENERATE(0.3, 1.6, 3.0, M_PI);
  CAPTURE(roll);
  const SE3 tilted =
      make_pose(so3_exp({0.0, 0.0, 0.7}) * so3_exp({roll, 0.0, 0.0}), {1.0, 2.0, 3.0});
  const Eigen::MatrixXd L = level(tilted.matrix().topRows<3>(), Eigen::Vector3d::Zero());
  // Rotation about the x axis, which is level.
  const SE3 expected = make_pose(so3_exp({0.0, 0.0, 0.7}), {1.0, 2.0, 3.0});
  CHECK(L.isApprox(expected.matrix().topRows<3>(), 1e-9));
}

}  // namespace km
