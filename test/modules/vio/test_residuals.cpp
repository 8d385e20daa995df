#include <Eigen/Cholesky>

#include "modules/vio/preintegration.hpp"
#include "modules/vio/window.hpp"
#include "synthetic_motion.hpp"
#include "test/support/numeric_jacobian.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

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

TEST_CASE("Reprojection Jacobians agree with differences") {
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

TEST_CASE("A reprojection error is in standard deviations of the image point") {
  const Camera camera = synthetic_rig().stereo.cameras[0];
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

void check_imu_derivatives(const ImuFactor& factor, const OdometryState& i,
                           const OdometryState& j) {
  const ImuTerm term = factor.linearize(i, j, i, j);
  CHECK(term.r == factor.error(i, j));
  check_derivative(term.J_i, numeric_jacobian<15>(
                                 [&](const Vector15& d) { return factor.error(moved(i, d), j); }));
  check_derivative(term.J_j, numeric_jacobian<15>(
                                 [&](const Vector15& d) { return factor.error(i, moved(j, d)); }));
}

TEST_CASE("Inertial Jacobians agree with differences") {
  const unsigned seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SyntheticMotion motion;
  const Stamp from = 100'000'000, to = 400'000'000;
  ImuPreintegration imu(ImuNoise{}, 0.01 * random_vector<3>(rng), 0.05 * random_vector<3>(rng));
  REQUIRE(imu.add(motion.samples(from, to, 5'000'000), from, to));
  const ImuFactor factor = ImuFactor::of(imu, kGravity_mps2).value();
  const OdometryState i = perturbed(motion.state(from), 0.1, rng);
  const OdometryState j = perturbed(motion.state(to), 0.1, rng);
  check_imu_derivatives(factor, i, j);
}

TEST_CASE("A factor at rest holds the state with any gravity and biases") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  constexpr double kRest_s = 100.0;
  const ImuFactor factor = ImuFactor::at_rest(ImuNoise{}, kRest_s);
  const OdometryState i = perturbed({}, 1.0, rng), j = perturbed(i, 0.1, rng);
  CHECK(factor.error(i, i).norm() < 1e-9);
  check_imu_derivatives(factor, i, j);
  Vector15 walked = Vector15::Zero();  // by a standard deviation of each bias
  walked.segment<3>(9).setConstant(std::sqrt(kRest_s) * ImuNoise{}.gyro_random_walk);
  walked.segment<3>(12).setConstant(std::sqrt(kRest_s) * ImuNoise{}.accel_random_walk);
  CHECK(factor.error(i, moved(i, walked)).squaredNorm() == Approx(6.0));
}

TEST_CASE("At its first estimates a prior's offset has the identity as derivative") {
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

constexpr Stamp kMillisecond = 1'000'000;

ImuPreintegration integrated(const SyntheticMotion& motion, Stamp to, Stamp step,
                             const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& accel_bias) {
  ImuPreintegration imu(ImuNoise{}, gyro_bias, accel_bias);
  REQUIRE(imu.add(motion.samples(0, to, step), 0, to));
  return imu;
}

// Largest error of the state predicted over 0.5 s [rad, m/s, m].
double prediction_error(Stamp step) {
  const SyntheticMotion motion;
  const Stamp end = 500 * kMillisecond;
  const ImuPreintegration imu =
      integrated(motion, end, step, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  const OdometryState predicted = predict(motion.state(0), imu, kGravity_mps2);
  const OdometryState truth = motion.state(end);
  const SE3 error = truth.T_odom_body.inverse() * predicted.T_odom_body;
  return std::max({angle_of(error.linear()), error.translation().norm(),
                   (truth.v_odom - predicted.v_odom).norm()});
}

TEST_CASE("Preintegration predicts a motion known in closed form to second order") {
  // Half a second of samples at 200 Hz, rates up to 0.5 rad/s: the step error is
  // dt^2 / 12 * second derivative, summed up below 1e-5.
  const double coarse = prediction_error(5 * kMillisecond);
  CHECK(coarse < 5e-5);
  CHECK(coarse / prediction_error(kMillisecond) > 20.0);  // 25 for order two, 5 for order one
}

TEST_CASE("Preintegration refuses an interval that its samples do not cover") {
  const SyntheticMotion motion;
  const auto samples = motion.samples(10, 20 * kMillisecond + 10, 5 * kMillisecond);
  ImuPreintegration imu(ImuNoise{}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  CHECK_FALSE(imu.add(samples, 9, kMillisecond));
  CHECK_FALSE(imu.add(samples, 10, 20 * kMillisecond + 11));
  CHECK_FALSE(imu.add(samples, 2000, 1000));
  CHECK_FALSE(imu.add({}, 0, 0));
  CHECK(imu.dt_s() == 0.0);
}

TEST_CASE("First-order bias correction agrees with a new integration") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SyntheticMotion motion;
  const Stamp end = 500 * kMillisecond, step = 5 * kMillisecond;
  const Eigen::Vector3d bg0 = 0.02 * random_vector<3>(rng), ba0 = 0.1 * random_vector<3>(rng);
  const ImuPreintegration imu = integrated(motion, end, step, bg0, ba0);
  // The error of the first order falls with the square of the change: 1e-4 leaves about 1e-8.
  const Eigen::Vector3d bg = bg0 + 1e-4 * random_vector<3>(rng);
  const Eigen::Vector3d ba = ba0 + 1e-4 * random_vector<3>(rng);
  const PreintegratedMotion corrected = imu.corrected(bg, ba);
  const PreintegratedMotion anew = integrated(motion, end, step, bg, ba).motion();
  CHECK(so3_log(corrected.dR.transpose() * anew.dR).norm() < 1e-7);
  CHECK((corrected.dv - anew.dv).norm() < 1e-7);
  CHECK((corrected.dp - anew.dp).norm() < 1e-7);
  CHECK((imu.motion().dv - anew.dv).norm() > 1e-5);  // the correction does something
}

TEST_CASE("The covariance of preintegration agrees with Monte Carlo") {
  constexpr int kTrials = 3000;
  const SyntheticMotion motion;
  const Stamp end = 300 * kMillisecond, step = 5 * kMillisecond;
  ImuNoise noise{.gyro_noise_density = 2e-3, .accel_noise_density = 2e-2};
  const auto exact = motion.samples(0, end, step);
  ImuPreintegration reference(noise, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  REQUIRE(reference.add(exact, 0, end));

  // Noise is white over the steps, as modelled: each step has its own.
  std::mt19937 rng(7);
  const double dt = seconds_between(0, step);
  Matrix9 sum = Matrix9::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    ImuPreintegration imu(noise, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k + 1 < exact.size(); ++k) {
      ImuSample a = exact[k], b = exact[k + 1];
      const Eigen::Vector3d n_gyro =
          noise.gyro_noise_density / std::sqrt(dt) * random_vector<3>(rng);
      const Eigen::Vector3d n_accel =
          noise.accel_noise_density / std::sqrt(dt) * random_vector<3>(rng);
      a.gyro += n_gyro, b.gyro += n_gyro, a.accel += n_accel, b.accel += n_accel;
      imu.add(a, b);
    }
    Eigen::Matrix<double, 9, 1> e;
    e << so3_log(reference.motion().dR.transpose() * imu.motion().dR),
        imu.motion().dv - reference.motion().dv, imu.motion().dp - reference.motion().dp;
    sum += e * e.transpose() / kTrials;
  }
  // Whitened by the model the sample covariance is the identity up to sqrt(2 / trials) = 2.6 % on
  // the diagonal; five of these.
  const Matrix9 L_inverse = reference.covariance().llt().matrixL().solve(Matrix9::Identity());
  const Matrix9 whitened = L_inverse * sum * L_inverse.transpose();
  CHECK((whitened - Matrix9::Identity()).cwiseAbs().maxCoeff() < 0.13);
}

constexpr int kSize = 12, kTaken = 5;

struct Quadratic {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

Quadratic random_quadratic(unsigned seed, int rows) {
  std::mt19937 rng(seed);
  Eigen::MatrixXd J(rows, kSize);
  for (int r = 0; r < rows; ++r) J.row(r) = random_vector<kSize>(rng).transpose();
  Eigen::VectorXd residual(rows);
  for (double& v : residual) v = random_vector<1>(rng)(0);
  return {J.transpose() * J, J.transpose() * residual};
}

TEST_CASE("Marginalisation does not change the batch solution of a linear problem") {
  const unsigned seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  const Quadratic q = random_quadratic(seed, 30);
  const SquareRootPrior prior = marginalize(q.H, q.g, kTaken);
  const Eigen::VectorXd batch = -q.H.ldlt().solve(q.g);
  const Eigen::MatrixXd H = prior.J.transpose() * prior.J;
  const Eigen::VectorXd solution = -H.ldlt().solve(prior.J.transpose() * prior.r);
  CHECK((solution - batch.tail(kSize - kTaken)).norm() < 1e-10);
  // The covariance of the remaining variables is unchanged too.
  const Eigen::MatrixXd covariance =
      q.H.inverse().bottomRightCorner(kSize - kTaken, kSize - kTaken);
  CHECK((H.inverse() - covariance).norm() < 1e-9 * covariance.norm());
}

}  // namespace
}  // namespace km
