#include "modules/vio/initialization.hpp"
#include "modules/vio/rest_detector.hpp"
#include "synthetic_motion.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kImages = 16;  // 0.75 s

StartGuess guess(const std::vector<InertialFrame>& frames) {
  VioConfig config{.gravity_mps2 = kGravity_mps2};
  return guess_start(frames, synthetic_rig(), config);
}

TEST_CASE("Upright turns the specific force to the vertical") {
  const auto accel = GENERATE(Eigen::Vector3d(9.8, 1, 0), Eigen::Vector3d(0, 0, 9.81),
                              Eigen::Vector3d(0, 0, -9.81), Eigen::Vector3d(9.81, 0, 0),
                              Eigen::Vector3d(0, -9.81, 0), Eigen::Vector3d(1, 2, 3));
  const Eigen::Matrix3d R = upright(accel);
  CHECK((R * accel.normalized() - Eigen::Vector3d::UnitZ()).norm() < 1e-7);
  CHECK(R.determinant() == Approx(1.0));
  CHECK((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
}

TEST_CASE("A start in motion finds gravity, velocities and the gyro's bias") {
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

TEST_CASE("Images at rest with inertial data of a motion are not detected as rest") {
  SyntheticWorld still(SyntheticMotion::standing(), 3), moving(SyntheticMotion{}, 3);
  auto frames = still.frames(kImages, 0.1);
  const auto other = moving.frames(kImages);
  for (std::size_t k = 0; k < frames.size(); ++k) frames[k].samples = other[k].samples;
  CHECK(guess(frames).status != StartStatus::kAtRest);
}

TEST_CASE("Inertial data that contradict the images are inconsistent") {
  SyntheticWorld world(SyntheticMotion{}, 4);
  auto frames = world.frames(kImages, 0.1);
  for (InertialFrame& frame : frames)
    for (ImuSample& sample : frame.samples) sample.accel *= 0.5;
  CHECK(guess(frames).status == StartStatus::kInconsistent);
}

TEST_CASE("A start distinguishes too few features from too few images") {
  SyntheticWorld world(SyntheticMotion{}, 5);
  auto frames = world.frames(kImages);
  CHECK(guess({frames.begin(), frames.begin() + 3}).status == StartStatus::kTooFewImages);
  for (InertialFrame& frame : frames)
    frame.tracked.features.resize(std::min<std::size_t>(frame.tracked.features.size(), 8));
  CHECK(guess(frames).status == StartStatus::kTooFewFeatures);
  for (InertialFrame& frame : frames) frame.tracked.features.clear();
  CHECK(guess(frames).status == StartStatus::kTooFewFeatures);
}

constexpr double kNoisePx = 0.1;  // noise of tracks on one patch

SyntheticMotion standing() {
  SyntheticMotion motion = SyntheticMotion::standing();
  motion.gyro_bias = {0.02, -0.01, 0.03};
  motion.accel_bias = {0.1, 0.05, -0.1};
  return motion;
}

VioConfig rest_config() {
  VioConfig config{.gravity_mps2 = kGravity_mps2};
  return config;
}

// Number of images before the first one at rest; all images if there is none. `estimate` changes
// the true state into the estimated one.
std::size_t images_before_rest(
    const std::vector<InertialFrame>& frames, const SyntheticMotion& motion,
    const std::function<void(OdometryState&)>& estimate = [](OdometryState&) {}) {
  RestDetector detector(rest_config(), synthetic_rig().stereo.cameras[0].fx);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    OdometryState state = motion.state(frames[k].tracked.stamp);
    estimate(state);
    if (detector.add(frames[k], state)) return k;
  }
  return frames.size();
}

// Makes the estimated speed low enough for a rest.
void thought_slow(OdometryState& state) {
  state.v_odom.setZero();
}

constexpr int kTenSeconds = 200;  // 10 s

TEST_CASE("A slow rotation is not detected as rest") {
  SyntheticMotion motion = standing();
  motion.turn_amplitude(2) = 0.1;  // 0.01 rad/s at most, 0.005 at both ends
  motion.turn_frequency(2) = 0.1;
  SyntheticWorld world(motion, 3);
  CHECK(images_before_rest(world.frames(kTenSeconds, kNoisePx), motion, thought_slow) ==
        kTenSeconds);
}

TEST_CASE("Frozen images are not detected as rest while the body rotates or accelerates") {
  const SyntheticMotion motion = standing();
  SyntheticWorld world(motion, 4);
  auto frames = world.frames(kTenSeconds, kNoisePx);
  const bool turns = GENERATE(true, false);
  for (InertialFrame& frame : frames)
    for (ImuSample& sample : frame.samples) {
      if (turns)
        sample.gyro.z() += 0.1;
      else
        sample.accel.x() += 0.7 * std::sin(3.0 * seconds_between(0, sample.stamp));
    }
  CHECK(images_before_rest(frames, motion) == kTenSeconds);
}

TEST_CASE("A rest ends with the first image that shows a motion and not with passing objects") {
  const SyntheticMotion motion = standing();
  SyntheticWorld world(motion, 7);
  auto frames = world.frames(60, kNoisePx);
  RestDetector detector(rest_config(), synthetic_rig().stereo.cameras[0].fx);
  const auto add = [&](std::size_t k, double share, double shift_px) {
    auto& features = frames[k].tracked.features;
    const auto count = static_cast<std::size_t>(share * static_cast<double>(features.size()));
    for (std::size_t i = 0; i < count; ++i)
      features[i].left.x() += shift_px / synthetic_rig().stereo.cameras[0].fx;
    return detector.add(frames[k], motion.state(frames[k].tracked.stamp));
  };
  for (std::size_t k = 0; k <= 20; ++k) (void)add(k, 0.0, 0.0);
  for (std::size_t k = 21; k < 30; ++k) CHECK(add(k, 0.3, 20.0));
  CHECK(add(30, 1.0, 1.5));  // it trembles
  CHECK_FALSE(add(31, 1.0, 3.0));
  CHECK_FALSE(add(32, 0.0, 0.0));
}

}  // namespace
}  // namespace km
