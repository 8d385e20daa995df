#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "modules/simulation/motion/gaussian_random.hpp"
#include "modules/simulation/motion/spline_trajectory.hpp"
#include "test/modules/simulation/motion/motion_checks.hpp"

namespace km {
namespace {

using Control = SplineTrajectory::Control;

// A lively motion: steps of about 0.2 m and 12 degrees between controls.
std::vector<Control> lively_controls(std::uint64_t seed, int count) {
  GaussianRandom random{SeededRandom(seed)};
  SE3 T = SE3::Identity();
  std::vector<Control> controls;
  for (int k = 0; k < count; ++k) {
    Vector6 step;
    step << 0.12 * random.draw3(), 0.12 * random.draw3();
    T = T * se3_exp(step);
    controls.push_back(spline_control(T));
  }
  return controls;
}

TEST_CASE("The weights of the basis sum to one and their derivatives to nothing", "[motion]") {
  for (double u = 0.0; u <= 1.0; u += 0.125) {
    const QuinticBasis basis = QuinticBasis::at(u);
    CAPTURE(u);
    CHECK(basis.value.sum() == Approx(1.0).epsilon(1e-14));
    CHECK(std::abs(basis.first.sum()) < 1e-14);
    CHECK(std::abs(basis.second.sum()) < 1e-14);
    CHECK(basis.value.minCoeff() > -1e-15);
  }
}

TEST_CASE("The basis joins with four continuous derivatives", "[motion]") {
  // Each weight at the end of an interval is that of the control before at the start of the next.
  const QuinticBasis end = QuinticBasis::at(1.0);
  const QuinticBasis start = QuinticBasis::at(0.0);
  for (int k = 1; k < 6; ++k) {
    CHECK(end.value[k] == Approx(start.value[k - 1]).margin(1e-15));
    CHECK(end.first[k] == Approx(start.first[k - 1]).margin(1e-15));
    CHECK(end.second[k] == Approx(start.second[k - 1]).margin(1e-15));
  }
  CHECK(end.value[0] == Approx(0.0).margin(1e-15));
  // The known values of the quintic B-spline at its knots.
  CHECK(start.value[2] == Approx(66.0 / 120.0));
  CHECK(start.value[1] == Approx(26.0 / 120.0));
  CHECK(start.value[0] == Approx(1.0 / 120.0));
}

TEST_CASE("A spline states the derivatives of its own poses", "[motion]") {
  const std::uint64_t seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const SplineTrajectory trajectory(3.0, 0.2, lively_controls(seed, 60));
  // Central differences err by h^2 / 6 times the third derivative, here below 1e3 units: 2e-6.
  const DerivativeErrors errors = derivative_errors(trajectory, 400, 1e-4);
  CHECK(errors.velocity < 2e-6);
  CHECK(errors.acceleration < 2e-5);
  CHECK(errors.angular_velocity < 2e-6);
}

TEST_CASE("A spline is four times continuously differentiable across its intervals", "[motion]") {
  const SplineTrajectory trajectory(0.0, 0.2, lively_controls(7, 30));
  constexpr double kEpsilon = 1e-9;
  for (int k = 1; k < 24; ++k) {
    const BodyMotion before = trajectory.motion(0.2 * k - kEpsilon);
    const BodyMotion after = trajectory.motion(0.2 * k + kEpsilon);
    CHECK((before.acceleration_world - after.acceleration_world).norm() < 1e-5);
    CHECK((before.angular_velocity_body - after.angular_velocity_body).norm() < 1e-6);
  }
}

TEST_CASE("Turning the world turns the curve alike", "[motion]") {
  const std::vector<Control> controls = lively_controls(4, 20);
  const Eigen::Quaterniond turn(so3_exp({0.4, -1.1, 2.0}));
  std::vector<Control> turned;
  for (const Control& control : controls) {
    Control moved;
    moved << turn * control.head<3>(),
        (turn * Eigen::Quaterniond(control.tail<4>().eval())).coeffs();
    turned.push_back(moved);
  }
  const SplineTrajectory a(0.0, 0.1, controls), b(0.0, 0.1, turned);
  for (double t = 0.0; t <= 1.5; t += 0.037) {
    const BodyMotion m = a.motion(t), n = b.motion(t);
    CHECK((turn * m.T_world_body.linear() - n.T_world_body.linear()).norm() < 1e-12);
    CHECK((m.angular_velocity_body - n.angular_velocity_body).norm() < 1e-11);
    CHECK((turn * m.acceleration_world - n.acceleration_world).norm() < 1e-10);
  }
}

TEST_CASE("The sign of a control's quaternion does not matter", "[motion]") {
  const std::vector<Control> controls = lively_controls(5, 20);
  std::vector<Control> flipped = controls;
  for (std::size_t k = 0; k < flipped.size(); k += 3)
    flipped[k].tail<4>() = -flipped[k].tail<4>().eval();
  const SplineTrajectory a(0.0, 0.1, controls), b(0.0, 0.1, flipped);
  for (double t = 0.0; t <= 1.5; t += 0.04)
    CHECK(a.motion(t).T_world_body.isApprox(b.motion(t).T_world_body, 1e-12));
}

TEST_CASE("Even motion along a line and about an axis is reproduced", "[motion]") {
  // Controls on a line give the line. About an axis the rate is even up to the square of the step.
  const Eigen::Vector3d velocity(1.0, -0.5, 0.25), rate(0.1, 0.2, -0.3);
  std::vector<SE3> poses;
  for (int k = -2; k < 105; ++k)
    poses.push_back(make_pose(so3_exp(rate * 0.01 * k), velocity * 0.01 * k));
  const SplineTrajectory trajectory = spline_along(0.0, 0.01, poses);
  for (double t = 0.1; t < 0.9; t += 0.03) {
    const BodyMotion motion = trajectory.motion(t);
    CHECK((motion.T_world_body.translation() - velocity * t).norm() < 1e-12);
    CHECK((motion.velocity_world - velocity).norm() < 1e-11);
    CHECK(motion.acceleration_world.norm() < 1e-9);
    CHECK((motion.angular_velocity_body - rate).norm() < 1e-6);
    CHECK(so3_log(so3_exp(rate * t).transpose() * motion.T_world_body.linear()).norm() < 1e-8);
  }
}

TEST_CASE("Equal controls are a body at rest", "[motion]") {
  const SE3 T = make_pose(so3_exp({0.3, 0.2, -1.0}), {100.0, -50.0, 3.0});
  const SplineTrajectory trajectory = spline_along(1.0, 0.1, std::vector<SE3>(15, T));
  CHECK(trajectory.start_s() == 1.0);
  CHECK(trajectory.end_s() == Approx(2.0));
  check_at_rest(trajectory, 1.0, 2.0);
}

TEST_CASE("A spline refuses what is no motion", "[motion]") {
  const std::vector<Control> good = lively_controls(1, 10);
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, lively_controls(1, 5)), std::invalid_argument);
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.0, good), std::invalid_argument);
  CHECK_THROWS_AS(SplineTrajectory(0.0, -0.1, good), std::invalid_argument);
  CHECK_THROWS_AS(SplineTrajectory(std::numeric_limits<double>::quiet_NaN(), 0.1, good),
                  std::invalid_argument);
  std::vector<Control> bad = good;
  bad[4][1] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, bad), std::invalid_argument);
  bad = good;
  bad[4].tail<4>().setZero();
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, bad), std::invalid_argument);
  bad = std::vector<Control>(10, spline_control(SE3::Identity()));
  bad[5] = spline_control(make_pose(so3_exp({0.0, 0.0, 1.6}), {0.0, 0.0, 0.0}));  // 92 degrees
  CHECK_THROWS_AS(SplineTrajectory(0.0, 0.1, bad), std::invalid_argument);
  CHECK_THROWS_AS(spline_along(0.0, 0.1, std::vector<SE3>{}), std::invalid_argument);

  const SplineTrajectory trajectory(0.0, 0.1, good);
  CHECK_THROWS_AS(trajectory.motion(-0.001), std::out_of_range);
  CHECK_THROWS_AS(trajectory.motion(trajectory.end_s() + 0.001), std::out_of_range);
  CHECK_NOTHROW(trajectory.motion(trajectory.end_s()));
}

}  // namespace
}  // namespace km
