#include "modules/core/geometry/lie.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("Exponential and logarithm of SE(3) invert each other") {
  const unsigned seed = GENERATE(range(0U, 30U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 T = random_pose(rng);
  CHECK((se3_exp(se3_log(T)).matrix() - T.matrix()).norm() < 1e-12);
}

TEST_CASE("The rotation logarithm is exact near zero and near pi") {
  const double angle =
      GENERATE(0.0, 1e-12, 1e-6, 1e-4, 1.0, std::numbers::pi - 1e-7, std::numbers::pi - 1e-3);
  CAPTURE(angle);
  const Eigen::Vector3d phi = angle * Eigen::Vector3d(0.6, -0.48, 0.64);
  CHECK((so3_log(so3_exp(phi)) - phi).norm() < 1e-8);
}

TEST_CASE("A rotation by 90 degrees about z maps x to y") {
  const Eigen::Matrix3d R = so3_exp({0, 0, std::numbers::pi / 2});
  CHECK((R * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm() < 1e-15);
}

TEST_CASE("The rotation to z is the shortest one, also near the opposite direction") {
  const double angle = GENERATE(0.0, 1e-9, 0.3, 2.0, std::numbers::pi - 1e-6,
                                std::numbers::pi - 1e-9, std::numbers::pi);
  CAPTURE(angle);
  const Eigen::Vector3d u = so3_exp(angle * Eigen::Vector3d(0.6, -0.8, 0.0)).col(2);
  const Eigen::Matrix3d R = rotation_to_z(9.81 * u);
  CHECK((R * u - Eigen::Vector3d::UnitZ()).norm() < 1e-14);
  CHECK((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-14);
  CHECK(R.determinant() == Approx(1.0));
  CHECK(so3_log(R).norm() == Approx(angle).margin(1e-8));
}

TEST_CASE("A direction opposite to z is turned by a half turn") {
  const Eigen::Matrix3d R = rotation_to_z({0.0, 0.0, -2.0});
  CHECK(R * Eigen::Vector3d(0.0, 0.0, -2.0) == Eigen::Vector3d(0.0, 0.0, 2.0));
  CHECK(R.determinant() == 1.0);
}

TEST_CASE("The right Jacobian is the derivative of the exponential") {
  const double angle = GENERATE(0.0, 1e-6, 1e-3, 0.5, 2.5);
  CAPTURE(angle);
  const Eigen::Vector3d phi = angle * Eigen::Vector3d(2.0, -1.0, 2.0) / 3.0;
  const double h = 1e-6;
  Eigen::Matrix3d numeric;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(i);
    numeric.col(i) = so3_log(so3_exp(phi - step).transpose() * so3_exp(phi + step)) / (2.0 * h);
  }
  CHECK((so3_right_jacobian(phi) - numeric).norm() < 1e-8);
  CHECK((so3_right_jacobian_inverse(phi) * numeric - Eigen::Matrix3d::Identity()).norm() < 1e-8);
}

TEST_CASE("The adjoint moves a perturbation from right to left") {
  std::mt19937 rng(3);
  const SE3 T = random_pose(rng);
  const Vector6 xi = random_vector<6>(rng);
  CHECK(((T * se3_exp(xi)).matrix() - (se3_exp(adjoint(T) * xi) * T).matrix()).norm() < 1e-10);
}

TEST_CASE("Local coordinates invert a retraction that is T exp(delta) to first order") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 T = random_pose(rng);
  const Vector6 delta = 0.5 * random_vector<6>(rng);
  CHECK((local_coordinates(T, retract(T, delta)) - delta).norm() < 1e-12);
  const Vector6 small = 1e-5 * delta;
  CHECK((retract(T, small).matrix() - (T * se3_exp(small)).matrix()).norm() < 1e-9);
}

TEST_CASE("The nearest rotation of a reflection is a rotation") {
  const Eigen::Matrix3d R = nearest_rotation(Eigen::Vector3d(1.0, 1.0, -0.5).asDiagonal());
  CHECK(R.determinant() == Approx(1.0));
  CHECK((R - Eigen::Matrix3d::Identity()).norm() < 1e-12);
}

}  // namespace
}  // namespace km
