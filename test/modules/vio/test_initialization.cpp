#include <catch2/catch.hpp>

#include "modules/vio/initialization.hpp"
#include "synthetic_motion.hpp"

namespace km {
namespace {

constexpr int kImages = 16;  // 0.75 s

StartGuess guess(const std::vector<InertialFrame>& frames) {
  VioConfig config;
  config.gravity_mps2 = kGravity_mps2;
  return guess_start(frames, synthetic_rig(), config);
}

TEST_CASE("Upright turns the specific force to the vertical", "[vio]") {
  const auto accel = GENERATE(Eigen::Vector3d(9.8, 1, 0), Eigen::Vector3d(0, 0, 9.81),
                              Eigen::Vector3d(0, 0, -9.81), Eigen::Vector3d(9.81, 0, 0),
                              Eigen::Vector3d(0, -9.81, 0), Eigen::Vector3d(1, 2, 3));
  const Eigen::Matrix3d R = upright(accel);
  CHECK((R * accel.normalized() - Eigen::Vector3d::UnitZ()).norm() < 1e-7);
  CHECK(R.determinant() == Approx(1.0));
  CHECK((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
}

TEST_CASE("A start in motion finds gravity, velocities and the gyro's bias", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  SyntheticMotion motion;
  motion.gyro_bias = {0.02, -0.01, 0.03};
  SyntheticWorld world(motion, seed);
  const StartGuess start = guess(world.frames(kImages, 0.3));
  REQUIRE(start.status == StartStatus::kInMotion);
  // Motion from stereo alone errs by some millimetres: 0.02 m/s and 1 degree of tilt.
  for (std::size_t k = 0; k < start.states.size(); ++k) {
    const OdometryState truth = motion.state(start.states[k].stamp);
    CHECK((start.states[k].gyro_bias - motion.gyro_bias).norm() < 5e-3);
    const Eigen::Vector3d up = start.states[k].T_odom_body.linear().row(2).transpose();
    CHECK(up.cross(truth.T_odom_body.linear().row(2).transpose()).norm() < 0.02);
    CHECK((start.states[k].T_odom_body.linear().transpose() * start.states[k].v_odom -
           truth.T_odom_body.linear().transpose() * truth.v_odom)
              .norm() < 0.05);
  }
  CHECK(start.states.front().T_odom_body.translation().norm() == 0.0);
}

TEST_CASE("Images at rest with inertial data of a motion are not detected as rest", "[vio]") {
  SyntheticWorld still(SyntheticMotion::standing(), 3), moving(SyntheticMotion{}, 3);
  auto frames = still.frames(kImages, 0.1);
  const auto other = moving.frames(kImages);
  for (std::size_t k = 0; k < frames.size(); ++k) frames[k].samples = other[k].samples;
  CHECK(guess(frames).status != StartStatus::kAtRest);
}

TEST_CASE("Inertial data that contradict the images are inconsistent", "[vio]") {
  SyntheticWorld world(SyntheticMotion{}, 4);
  auto frames = world.frames(kImages, 0.1);
  for (InertialFrame& frame : frames)
    for (ImuSample& sample : frame.samples) sample.accel *= 0.5;
  CHECK(guess(frames).status == StartStatus::kInconsistent);
}

TEST_CASE("A start distinguishes too few features from too few images", "[vio]") {
  SyntheticWorld world(SyntheticMotion{}, 5);
  auto frames = world.frames(kImages);
  CHECK(guess({frames.begin(), frames.begin() + 3}).status == StartStatus::kTooFewImages);
  for (InertialFrame& frame : frames)
    frame.tracked.features.resize(std::min<std::size_t>(frame.tracked.features.size(), 8));
  CHECK(guess(frames).status == StartStatus::kTooFewFeatures);
  for (InertialFrame& frame : frames) frame.tracked.features.clear();
  CHECK(guess(frames).status == StartStatus::kTooFewFeatures);
}

}  // namespace
}  // namespace km
