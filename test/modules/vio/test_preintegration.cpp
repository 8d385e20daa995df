#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "modules/vio/preintegration.hpp"
#include "synthetic_motion.hpp"

namespace km {
namespace {

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

TEST_CASE("Preintegration predicts a motion known in closed form", "[vio]") {
  // Half a second of samples at 200 Hz, rates up to 0.5 rad/s: the step error is
  // dt^2 / 12 * second derivative, summed up below 1e-5.
  CHECK(prediction_error(5 * kMillisecond) < 5e-5);
}

TEST_CASE("Preintegration is of second order in the sampling period", "[vio]") {
  const double coarse = prediction_error(5 * kMillisecond);
  const double fine = prediction_error(kMillisecond);
  CHECK(coarse / fine > 20.0);  // 25 for order two, 5 for order one
}

TEST_CASE("Preintegration interpolates at both borders", "[vio]") {
  const SyntheticMotion motion;
  const Stamp from = 12 * kMillisecond + 345'678, to = 98 * kMillisecond + 7;
  ImuPreintegration imu(ImuNoise{}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  REQUIRE(imu.add(motion.samples(0, 200 * kMillisecond, 5 * kMillisecond), from, to));
  CHECK(imu.dt_s() == Approx(seconds_between(from, to)).epsilon(1e-12));
  const OdometryState predicted = predict(motion.state(from), imu, kGravity_mps2);
  const SE3 error = motion.state(to).T_odom_body.inverse() * predicted.T_odom_body;
  CHECK(se3_log(error).norm() < 1e-5);
}

TEST_CASE("Preintegration refuses an interval that its samples do not cover", "[vio]") {
  const SyntheticMotion motion;
  const auto samples = motion.samples(10, 20 * kMillisecond + 10, 5 * kMillisecond);
  ImuPreintegration imu(ImuNoise{}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  CHECK_FALSE(imu.add(samples, 9, kMillisecond));
  CHECK_FALSE(imu.add(samples, 10, 20 * kMillisecond + 11));
  CHECK_FALSE(imu.add(samples, 2000, 1000));
  CHECK_FALSE(imu.add({}, 0, 0));
  CHECK(imu.dt_s() == 0.0);
}

TEST_CASE("First-order bias correction agrees with integrating anew", "[vio]") {
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

TEST_CASE("The covariance of preintegration agrees with Monte Carlo", "[vio]") {
  constexpr int kTrials = 3000;
  const SyntheticMotion motion;
  const Stamp end = 300 * kMillisecond, step = 5 * kMillisecond;
  ImuNoise noise;
  noise.gyro_noise_density = 2e-3;
  noise.accel_noise_density = 2e-2;
  const auto exact = motion.samples(0, end, step);
  ImuPreintegration reference(noise, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  REQUIRE(reference.add(exact, 0, end));

  // Noise is white over the steps, as the model has it: each step sees its own.
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

}  // namespace
}  // namespace km
