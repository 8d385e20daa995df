#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/symmetric_eigen.hpp"
#include "modules/tree_newton/edge_model.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Vector12 = Eigen::Matrix<double, 12, 1>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

struct Moved {
  SE3 measured;
  Precision precision;
  SE3 T_i;
  SE3 T_j;

  [[nodiscard]] double cost(const Vector12& xi) const {
    const SE3 i = retract(T_i, xi.head<6>());
    const SE3 j = retract(T_j, xi.tail<6>());
    return precision.kappa * (j.linear() - i.linear() * measured.linear()).squaredNorm() +
           precision.tau * (j.translation() - i.translation() - i.linear() * measured.translation())
                               .squaredNorm();
  }
};

Moved random_edge(std::mt19937& rng) {
  const SE3 T_i = random_pose(rng, 2.0);
  const SE3 T_j = random_pose(rng, 2.0);
  SE3 T_i_j = random_pose(rng, 2.0);
  return {T_i_j, {1.3, 0.7}, T_i, T_j};
}

Matrix12 hessian_of(const EdgeModel& model) {
  Matrix12 H;
  H << model.H_ii, model.H_ij, model.H_ij.transpose(), model.H_jj;
  return H;
}

}  // namespace

TEST_CASE("gradient and Hessian of an edge agree with finite differences") {
  const unsigned seed = GENERATE(1U, 2U, 3U, 4U, 5U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Moved moved = random_edge(rng);
  const EdgeModel model =
      model_edge(moved.measured, moved.precision, moved.T_i, moved.T_j, Curvature::kFull);
  const Matrix12 H = hessian_of(model);
  Vector12 g;
  g << model.g_i, model.g_j;
  CHECK(model.cost == Approx(moved.cost(Vector12::Zero())).epsilon(1e-12));
  // Central differences with step h: errors of order h^2, and for the second one also rounding over
  // h^2.
  constexpr double h = 1e-4;
  for (int k = 0; k < 20; ++k) {
    Vector12 d;
    d << random_vector<6>(rng), random_vector<6>(rng);
    const double up = moved.cost(h * d);
    const double down = moved.cost(-h * d);
    CHECK((up - down) / (2.0 * h) == Approx(g.dot(d)).margin(1e-4));
    CHECK((up - 2.0 * model.cost + down) / (h * h) == Approx(d.dot(H * d)).margin(1e-3));
  }
}

TEST_CASE("an edge without second derivatives has the same gradient") {
  std::mt19937 rng(7);
  const Moved moved = random_edge(rng);
  const EdgeModel model =
      model_edge(moved.measured, moved.precision, moved.T_i, moved.T_j, Curvature::kFull);
  EdgeModel slope;
  set_cost_and_gradient(moved.measured, moved.precision, moved.T_i, moved.T_j, slope);
  CHECK(slope.cost == model.cost);
  CHECK(slope.g_i == model.g_i);
  CHECK(slope.g_j == model.g_j);
}

TEST_CASE(
    "the Gauss-Newton Hessian is never indefinite, and the full one is not at zero residual") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  Moved moved = random_edge(rng);
  const Matrix12 gauss_newton = hessian_of(
      model_edge(moved.measured, moved.precision, moved.T_i, moved.T_j, Curvature::kGaussNewton));
  CHECK(symmetric_eigen(gauss_newton).values.minCoeff() > -1e-12);
  // A rigid motion of both poses about the origin, to first order.
  const Eigen::Vector3d w = random_vector<3>(rng);
  const Eigen::Vector3d u = random_vector<3>(rng);
  Vector12 rigid;
  rigid << moved.T_i.linear().transpose() * w,
      moved.T_i.linear().transpose() * (w.cross(moved.T_i.translation()) + u),
      moved.T_j.linear().transpose() * w,
      moved.T_j.linear().transpose() * (w.cross(moved.T_j.translation()) + u);
  CHECK((gauss_newton * rigid).norm() < 1e-12 * gauss_newton.norm() * rigid.norm());
  moved.T_j = moved.T_i * moved.measured;
  const Matrix12 full = hessian_of(
      model_edge(moved.measured, moved.precision, moved.T_i, moved.T_j, Curvature::kFull));
  const Matrix12 same = hessian_of(
      model_edge(moved.measured, moved.precision, moved.T_i, moved.T_j, Curvature::kGaussNewton));
  CHECK((full - same).norm() < 1e-12 * full.norm());
}

}  // namespace km
