#include <catch2/catch.hpp>

#include "modules/vio/marginalization.hpp"
#include "synthetic_motion.hpp"
#include "test/support/numeric_jacobian.hpp"

namespace km {
namespace {

void check_derivative(const Eigen::MatrixXd& analytic, const Eigen::MatrixXd& numeric) {
  CHECK((analytic - numeric).norm() < 1e-6 * (1.0 + numeric.norm()));  // entries reach 1e6
}

// `state` moved along [rotation, translation, velocity, gyro bias, accelerometer bias].
OdometryState moved(OdometryState state, const Vector15& d) {
  state.T_odom_body = retract(state.T_odom_body, d.head<6>());
  state.v_odom += d.segment<3>(6);
  state.gyro_bias += d.segment<3>(9);
  state.accel_bias += d.segment<3>(12);
  return state;
}

OdometryState perturbed(const OdometryState& state, double size, std::mt19937& rng) {
  Vector15 d = size * random_vector<15>(rng);
  d.segment<3>(9) *= 0.1;
  return moved(state, d);
}

TEST_CASE("Reprojection Jacobians agree with differences", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 10U));
  const std::size_t camera = GENERATE(0U, 1U);
  CAPTURE(seed, camera);
  std::mt19937 rng(seed);
  const ViewModel view = view_model(synthetic_rig().stereo.cameras[camera], 0.7);
  const SE3 T = random_pose(rng);
  const Eigen::Vector3d p = T * Eigen::Vector3d(3.0, 0.5, -0.4);
  const Eigen::Vector2d bearing(0.1, -0.2);
  const auto error = [&](const SE3& T_odom_body, const Eigen::Vector3d& p_odom) {
    Eigen::Vector2d r;
    REQUIRE(reprojection_error(view, bearing, T_odom_body, p_odom, r));
    return r;
  };
  ReprojectionTerm term;
  REQUIRE(linearize_reprojection(view, bearing, T, T, p, term));
  CHECK(term.r == error(T, p));
  check_derivative(term.J_pose,
                   numeric_jacobian<6>([&](const Vector6& d) { return error(retract(T, d), p); }));
  check_derivative(term.J_point,
                   numeric_jacobian<3>([&](const Eigen::Vector3d& d) { return error(T, p + d); }));
}

TEST_CASE("A reprojection error is in standard deviations of the image point", "[vio]") {
  const PinholeCamera camera = synthetic_rig().stereo.cameras[0];
  const ViewModel view = view_model(camera, 0.5);
  const SE3 T = SE3::Identity();
  const Eigen::Vector3d p = camera.T_body_cam * Eigen::Vector3d(0.2, -0.1, 2.0);
  Eigen::Vector2d r;
  REQUIRE(reprojection_error(view, Eigen::Vector2d(0.1, -0.05), T, p, r));
  CHECK(r.norm() < 1e-12);
  REQUIRE(reprojection_error(view, Eigen::Vector2d(0.1 + 1.0 / camera.fx, -0.05), T, p, r));
  CHECK(r.x() == Approx(-2.0));  // 1 px of 0.5 px
  CHECK_FALSE(reprojection_error(view, Eigen::Vector2d::Zero(), T,
                                 camera.T_body_cam * Eigen::Vector3d(0, 0, -1), r));
}

TEST_CASE("With a first estimate only the derivatives are taken there", "[vio]") {
  std::mt19937 rng(3);
  const ViewModel view = view_model(synthetic_rig().stereo.cameras[0], 1.0);
  const SE3 T = random_pose(rng);
  const SE3 T_first = retract(T, 0.05 * random_vector<6>(rng));
  const Eigen::Vector3d p = T * Eigen::Vector3d(3.0, 0.5, -0.4);
  const Eigen::Vector2d bearing(0.1, -0.2);
  ReprojectionTerm now, first, both;
  REQUIRE(linearize_reprojection(view, bearing, T, T, p, now));
  REQUIRE(linearize_reprojection(view, bearing, T_first, T_first, p, first));
  REQUIRE(linearize_reprojection(view, bearing, T, T_first, p, both));
  CHECK((both.r - now.r).norm() < 1e-12);
  CHECK((both.J_pose - first.J_pose).norm() < 1e-9);
  CHECK((both.J_point - first.J_point).norm() < 1e-9);
  CHECK((both.J_pose - now.J_pose).norm() > 1e-3);
}

TEST_CASE("Inertial Jacobians agree with differences", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SyntheticMotion motion;
  const Stamp from = 100'000'000, to = 400'000'000;
  ImuPreintegration imu(ImuNoise{}, 0.01 * random_vector<3>(rng), 0.05 * random_vector<3>(rng));
  REQUIRE(imu.add(motion.samples(from, to, 5'000'000), from, to));
  const ImuFactor factor(imu, kGravity_mps2);
  const OdometryState i = perturbed(motion.state(from), 0.1, rng);
  const OdometryState j = perturbed(motion.state(to), 0.1, rng);
  const ImuTerm term = factor.linearize(i, j, i, j);
  CHECK(term.r == factor.error(i, j));
  check_derivative(term.J_i, numeric_jacobian<15>(
                                 [&](const Vector15& d) { return factor.error(moved(i, d), j); }));
  check_derivative(term.J_j, numeric_jacobian<15>(
                                 [&](const Vector15& d) { return factor.error(i, moved(j, d)); }));
}

TEST_CASE("The inertial error of the true motion is zero, whatever the frame", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  SyntheticMotion motion;
  motion.gyro_bias = 0.02 * random_vector<3>(rng);
  motion.accel_bias = 0.1 * random_vector<3>(rng);
  const Stamp to = 200'000'000;
  ImuPreintegration imu(ImuNoise{}, motion.gyro_bias, motion.accel_bias);
  REQUIRE(imu.add(motion.samples(0, to, 500'000), 0, to));
  const ImuFactor factor(imu, kGravity_mps2);
  OdometryState i = motion.state(0), j = motion.state(to);
  const double standard_deviations = factor.error(i, j).norm();
  CHECK(standard_deviations < 0.01);
  // Heading and position of odom are free.
  const SE3 shift = make_pose(so3_exp(Eigen::Vector3d(0, 0, 1.3)), random_vector<3>(rng));
  for (OdometryState* s : {&i, &j}) {
    s->T_odom_body = shift * s->T_odom_body;
    s->v_odom = shift.linear() * s->v_odom;
  }
  CHECK(factor.error(i, j).norm() == Approx(standard_deviations).margin(1e-6));
}

TEST_CASE("An inertial factor over no time is refused", "[vio]") {
  const ImuPreintegration imu(ImuNoise{}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  CHECK_THROWS_AS(ImuFactor(imu, kGravity_mps2), std::invalid_argument);
}

TEST_CASE("At its first estimates a prior's offset moves as its states do", "[vio]") {
  std::mt19937 rng(11);
  StatePrior prior;
  std::vector<const OdometryState*> states;
  for (std::uint64_t k = 0; k < 3; ++k) {
    prior.frames.push_back(k);
    prior.linearization.push_back(perturbed({}, 1.0, rng));
  }
  for (const OdometryState& state : prior.linearization) states.push_back(&state);
  CHECK(prior_offset(prior, states).norm() < 1e-12);
  for (std::size_t k = 0; k < 3; ++k) {
    CAPTURE(k);
    const Eigen::MatrixXd by_state = numeric_jacobian<15>([&](const Vector15& d) {
      const OdometryState state = moved(prior.linearization[k], d);
      std::vector<const OdometryState*> others = states;
      others[k] = &state;
      return prior_offset(prior, others);
    });
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(prior.dimension(), 15);
    const Eigen::Index column = k == 0 ? 0 : 9 + 6 * static_cast<Eigen::Index>(k);
    const Eigen::Index size = k == 0 ? 15 : 6;  // only the first has velocity and biases
    expected.block(column, 0, size, size).setIdentity();
    check_derivative(expected, by_state);
  }
}

}  // namespace
}  // namespace km
