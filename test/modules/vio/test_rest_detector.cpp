#include <catch2/catch.hpp>
#include <functional>

#include "modules/vio/rest_detector.hpp"
#include "synthetic_motion.hpp"

namespace km {
namespace {

constexpr double kNoisePx = 0.1;  // noise of tracks on one patch

SyntheticMotion standing() {
  SyntheticMotion motion = SyntheticMotion::standing();
  motion.gyro_bias = {0.02, -0.01, 0.03};
  motion.accel_bias = {0.1, 0.05, -0.1};
  return motion;
}

VioConfig rest_config() {
  VioConfig config;
  config.gravity_mps2 = kGravity_mps2;
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

TEST_CASE("A slow rotation is not detected as rest", "[vio][rest]") {
  SyntheticMotion motion = standing();
  motion.turn_amplitude(2) = 0.1;  // 0.01 rad/s at most, 0.005 at both ends
  motion.turn_frequency(2) = 0.1;
  SyntheticWorld world(motion, 3);
  CHECK(images_before_rest(world.frames(kTenSeconds, kNoisePx), motion, thought_slow) ==
        kTenSeconds);
}

TEST_CASE("Frozen images are not detected as rest while the body rotates or accelerates",
          "[vio][rest]") {
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

TEST_CASE("A rest ends with the first image that shows a motion and not with passing objects",
          "[vio][rest]") {
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
