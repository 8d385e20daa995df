#include <algorithm>
#include <catch2/catch.hpp>
#include <optional>
#include <random>

#include "modules/core/covariance.hpp"
#include "modules/vio/vio.hpp"
#include "synthetic_motion.hpp"
#include "textured_plane.hpp"

// Odometry of bodies that stand still for a while.

namespace km {
namespace {

// A smooth motion along a textured wall, x of the body upwards: sideways by `distance_m` from
// `begin_s` on, for `duration_s`; at rest before and after.
struct Glide {
  double begin_s = 0.0;
  double duration_s = 3.0;
  double distance_m = 1.0;

  [[nodiscard]] double share(double t) const {
    return std::clamp((t - begin_s) / duration_s, 0.0, 1.0);
  }
  [[nodiscard]] SE3 T_world_body(double t) const {
    const double s = share(t);
    const double sideways = distance_m * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    return make_pose(Eigen::Matrix3d::Identity(), {0.0, sideways, 0.0});
  }
  [[nodiscard]] double acceleration_mps2(double t) const {
    const double s = share(t);
    return distance_m / (duration_s * duration_s) * s * (60.0 - 180.0 * s + 120.0 * s * s);
  }
};

// Measurements of the body's sensors, with noise in images and samples.
class Ride {
 public:
  explicit Ride(const Glide& glide) : glide_(glide) { rig_.stereo = test_rig(); }

  // The next image, with the samples since the one before.
  SensorPacket next() {
    SensorPacket packet;
    const Stamp stamp = kFrameStep * image_;
    for (Stamp s = kFrameStep * std::max(image_ - 1, 0); s <= stamp; s += kImuStep)
      packet.imu.push_back(sample(s));
    packet.frame = std::make_shared<StereoFrame>(seen(stamp));
    ++image_;
    return packet;
  }

  [[nodiscard]] SE3 T_world_body(Stamp stamp) const {
    return glide_.T_world_body(seconds_between(0, stamp));
  }
  Vio vio() const {
    VioConfig config;
    config.gravity_mps2 = kGravity_mps2;
    return Vio(3, rig_, TrackerConfig{}, config);
  }

  static constexpr Stamp kFrameStep = 50'000'000;
  inline static const Eigen::Vector3d kGyroBias{0.01, 0.02, -0.01};

 private:
  static constexpr Stamp kImuStep = 5'000'000;

  ImuSample sample(Stamp stamp) {
    if (stamp == last_.stamp) return last_;  // the border of two packets
    const double rate_root = std::sqrt(rig_.imu.rate_hz);
    const double sideways = glide_.acceleration_mps2(seconds_between(0, stamp));
    last_ = {stamp, kGyroBias, {kGravity_mps2, sideways, 0.0}};
    last_.gyro += rate_root * rig_.imu.gyro_noise_density * random_vector<3>(rng_);
    last_.accel += rate_root * rig_.imu.accel_noise_density * random_vector<3>(rng_);
    return last_;
  }
  StereoFrame seen(Stamp stamp) {
    const SE3 T = T_world_body(stamp);
    if (!still_ || !T.isApprox(T_still_)) still_ = wall_.render(rig_.stereo, T, stamp);
    T_still_ = T;
    StereoFrame frame = *still_;
    frame.stamp = stamp;
    for (GrayImage* const image : {&frame.left, &frame.right})
      for (std::uint8_t& pixel : image->pixels)
        pixel = static_cast<std::uint8_t>(
            std::clamp<int>(pixel + static_cast<int>(rng_() % 7U) - 3, 0, 255));  // 2 levels
    return frame;
  }

  Glide glide_;
  SensorRig rig_;
  TexturedPlane wall_;
  std::mt19937 rng_{1};
  int image_ = 0;
  ImuSample last_{-1, {}, {}};
  std::optional<StereoFrame> still_;
  SE3 T_still_ = SE3::Identity();
};

VioResult feed(Vio& vio, Ride& ride, double seconds) {
  VioResult all;
  for (int k = 0; k < seconds / seconds_between(0, Ride::kFrameStep); ++k) {
    const VioResult result = vio.process(ride.next());
    CHECK(result.problem == VioProblem::kNone);
    all.states.insert(all.states.end(), result.states.begin(), result.states.end());
    all.keyframes.insert(all.keyframes.end(), result.keyframes.begin(), result.keyframes.end());
    all.frames.insert(all.frames.end(), result.frames.begin(), result.frames.end());
  }
  return all;
}

TEST_CASE("During a minute at rest the pose does not move and no keyframes are made",
          "[vio][rest]") {
  Ride ride(Glide{.begin_s = 1e3});
  Vio vio = ride.vio();
  const VioResult result = feed(vio, ride, 60.0);
  CHECK(vio.statistics().rests == 1);
  // There is a second keyframe if the first leaves the window before the rest is detected.
  CHECK(result.keyframes.size() <= 2);
  CHECK(result.keyframes.back().stamp <= 2'000'000'000);
  REQUIRE(result.states.size() == 1200);
  REQUIRE(result.frames.size() == 1200);
  const SE3 first = result.states.front().T_odom_body;
  for (const OdometryState& state : result.states) {
    const SE3 T = first.inverse() * state.T_odom_body;
    CHECK(T.translation().norm() < 1e-3);
    CHECK(angle_of(T.linear()) < 2e-3);
  }
  for (const LocatedFrame& frame : result.frames)
    CHECK((first.inverse() * frame.T_odom_body).translation().norm() < 1e-3);
  CHECK((result.states.back().gyro_bias - Ride::kGyroBias).norm() < 2e-3);
}

TEST_CASE("After a rest the next keyframe is measured from the one before it", "[vio][rest]") {
  const Glide glide{.begin_s = 30.0};
  Ride ride(glide);
  Vio vio = ride.vio();
  (void)feed(vio, ride, 30.0);
  CHECK(vio.statistics().rests == 1);
  const VioResult result = feed(vio, ride, 4.0);
  REQUIRE(result.states.size() == 80);  // all images have a pose
  REQUIRE(result.keyframes.size() >= 5);
  Stamp before = 0;  // the start's keyframe
  for (const KeyframeOdometry& keyframe : result.keyframes) {
    const SE3 T = ride.T_world_body(before).inverse() * ride.T_world_body(keyframe.stamp);
    CHECK(std::abs(keyframe.T_previous_kf.translation().norm() - T.translation().norm()) < 0.01);
    CHECK(is_covariance(keyframe.covariance));
    // 30 s at rest are no drift.
    CHECK(keyframe.covariance.diagonal().tail<3>().maxCoeff() < 0.015 * 0.015);
    before = keyframe.stamp;
  }
  const SE3 T = result.states.front().T_odom_body.inverse() * result.states.back().T_odom_body;
  CHECK(T.translation().norm() == Approx(glide.distance_m).epsilon(0.02));
}

TEST_CASE("Slow motion does not shorten the trajectory", "[vio][rest]") {
  // 2.5, 10 and 25 mm/s on average
  const auto [distance_m, duration_s] =
      GENERATE(table<double, double>({{0.05, 20.0}, {0.1, 10.0}, {0.25, 10.0}}));
  constexpr double kMargin_m = 0.01;
  CAPTURE(distance_m);
  Ride ride(Glide{.begin_s = 3.0, .duration_s = duration_s, .distance_m = distance_m});
  Vio vio = ride.vio();
  const VioResult result = feed(vio, ride, duration_s + 5.0);
  for (const OdometryState& state : result.states)
    CHECK(state.T_odom_body.translation().norm() ==
          Approx(ride.T_world_body(state.stamp).translation().norm()).margin(kMargin_m));
  SE3 T = SE3::Identity();
  for (const KeyframeOdometry& keyframe : result.keyframes) T = T * keyframe.T_previous_kf;
  CHECK(T.translation().norm() ==
        Approx(ride.T_world_body(result.keyframes.back().stamp).translation().norm())
            .margin(kMargin_m));
}

}  // namespace
}  // namespace km
