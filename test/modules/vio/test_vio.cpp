#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/vio/keyframe_rule.hpp"
#include "modules/vio/vio.hpp"
#include "synthetic_motion.hpp"
#include "test/support/test.hpp"
#include "textured_plane.hpp"

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

// Measurements of a rig beside a textured wall, x of the body upwards, in the form that sensors
// deliver.
class Ride {
 public:
  // At rest and exact.
  Ride() : Ride(Glide{.begin_s = 1e6}) { is_noisy_ = false; }
  // With noise in images and samples; images in order.
  explicit Ride(const Glide& glide) : glide_(glide) { rig_.stereo = test_rig(); }

  SensorPacket packet(int image) {
    SensorPacket packet{.frame = std::make_shared<StereoFrame>(seen(image * kFrameStep)),
                        .imu = samples(std::max(image - 1, 0), image)};
    return packet;
  }
  // From image `first` to image `last`, both included.
  std::vector<ImuSample> samples(int first, int last) {
    std::vector<ImuSample> all;
    for (Stamp s = first * kFrameStep; s <= last * kFrameStep; s += kImuStep)
      all.push_back(sample(s));
    return all;
  }
  [[nodiscard]] SE3 T_world_body(Stamp stamp) const {
    return glide_.T_world_body(seconds_between(0, stamp));
  }

  Vio vio(double rest_s = VioConfig{}.rest_s) const {
    VioConfig config{.gravity_mps2 = kGravity_mps2, .rest_s = rest_s};
    return Vio(3, rig_, TrackerConfig{}, config);
  }
  // Detects no rest, so that there is a keyframe every 2 s.
  Vio restless() const { return vio(1e6); }

  static constexpr Stamp kFrameStep = 50'000'000;
  static constexpr int kStartImages = 16;
  inline static const Eigen::Vector3d kGyroBias{0.01, 0.02, -0.01};

 private:
  static constexpr Stamp kImuStep = 5'000'000;

  ImuSample sample(Stamp stamp) {
    if (stamp == last_.stamp) return last_;  // the border of two packets
    const double rate_root = is_noisy_ ? std::sqrt(rig_.imu.rate_hz) : 0.0;
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
    if (!is_noisy_) return frame;
    for (GrayImage* const image : {&frame.left, &frame.right})
      for (std::uint8_t& pixel : image->pixels)
        pixel = static_cast<std::uint8_t>(
            std::clamp<int>(pixel + static_cast<int>(rng_() % 7U) - 3, 0, 255));  // 2 levels
    return frame;
  }

  Glide glide_;
  bool is_noisy_ = true;
  SensorRig rig_;
  TexturedPlane wall_;
  std::mt19937 rng_{1};
  ImuSample last_{-1, {}, {}};
  std::optional<StereoFrame> still_;
  SE3 T_still_ = SE3::Identity();
};

// Feeds images `first` to `last`, not included; returns all their results together.
VioResult feed(Vio& vio, Ride& ride, int first, int last) {
  VioResult all;
  for (int k = first; k < last; ++k) {
    const VioResult result = vio.process(ride.packet(k));
    all.states.insert(all.states.end(), result.states.begin(), result.states.end());
    all.keyframes.insert(all.keyframes.end(), result.keyframes.begin(), result.keyframes.end());
    all.frames.insert(all.frames.end(), result.frames.begin(), result.frames.end());
    if (result.start) all.start = result.start;
    if (result.problem != VioProblem::kNone) all.problem = result.problem;
  }
  return all;
}

TEST_CASE("Keyframes are numbered without gaps and chain by their relative poses") {
  Ride ride;
  Vio vio = ride.restless();
  const VioResult result = feed(vio, ride, 0, 100);
  REQUIRE(result.keyframes.size() >= 3);  // 5 s at rest, one every 2 s
  SE3 T_odom_kf = SE3::Identity();
  double information = 0.0;  // on a tilt error common to all verticals
  for (std::size_t k = 0; k < result.keyframes.size(); ++k) {
    const KeyframeOdometry& keyframe = result.keyframes[k];
    CHECK(keyframe.id == KeyframeId{3, static_cast<std::uint32_t>(k)});
    T_odom_kf = T_odom_kf * keyframe.T_previous_kf;
    CHECK((T_odom_kf.matrix() - keyframe.T_odom_kf.matrix()).norm() < 1e-9);
    CHECK(is_covariance(keyframe.covariance));
    CHECK((keyframe.covariance.trace() > 0.0) == (k > 0));
    REQUIRE(keyframe.vertical);
    CHECK(keyframe.vertical->up_body.dot(Eigen::Vector3d::UnitX()) > 1.0 - 1e-8);  // on its side
    information += 1.0 / std::pow(keyframe.vertical->sigma_rad, 2);
  }
  // The common error of any number of verticals is that of one.
  const VioConfig config;
  const double stretches = static_cast<double>(result.keyframes.size()) / 120.0;
  CHECK(std::sqrt(stretches / information) == Approx(config.tilt_sigma));
}

TEST_CASE("Every image is located by the last keyframe at or before it") {
  Ride ride;
  Vio vio = ride.restless();
  const VioResult result = feed(vio, ride, 0, 100);
  REQUIRE(result.frames.size() == result.states.size());
  REQUIRE(result.keyframes.size() >= 3);
  std::size_t last = 0, of_keyframes = 0;
  for (std::size_t k = 0; k < result.frames.size(); ++k) {
    const LocatedFrame& frame = result.frames[k];
    REQUIRE(frame.frame->stamp == result.states[k].stamp);
    while (last + 1 < result.keyframes.size() &&
           result.keyframes[last + 1].stamp <= frame.frame->stamp)
      ++last;
    const KeyframeOdometry& keyframe = result.keyframes[last];
    CHECK(frame.keyframe == keyframe.id.index);
    const SE3 T_kf_body = keyframe.T_odom_kf.inverse() * frame.T_odom_body;
    const double moved_m = T_kf_body.translation().norm();
    const bool of_keyframe = frame.frame->stamp == keyframe.stamp;
    CHECK(moved_m < (of_keyframe ? 1e-9 : 1e-3));  // at rest
    of_keyframes += of_keyframe ? 1 : 0;
  }
  CHECK(of_keyframes == result.keyframes.size());
}

TEST_CASE("Packets without a usable image are refused and counted") {
  Ride ride;
  Vio vio = ride.vio();
  REQUIRE(feed(vio, ride, 0, 20).states.size() == 20);

  SensorPacket no_image = ride.packet(20);
  no_image.frame = nullptr;
  CHECK(vio.process(no_image).problem == VioProblem::kNoImage);
  SensorPacket small = ride.packet(21);
  auto frame = std::make_shared<StereoFrame>(*small.frame);
  frame->right.pixels.pop_back();
  small.frame = frame;
  CHECK(vio.process(small).problem == VioProblem::kNoImage);
  CHECK(vio.process(ride.packet(19)).problem == VioProblem::kUnorderedImage);
  CHECK(vio.statistics().refused_images == 3);

  // Their inertial samples were kept, so the next image continues without a new start.
  const VioResult next = vio.process(ride.packet(22));
  CHECK(next.problem == VioProblem::kNone);
  CHECK(next.states.size() == 1);
  CHECK(vio.statistics().starts == 1);
}

TEST_CASE("Invalid inertial samples are refused and the image still has a pose") {
  Ride ride;
  Vio vio = ride.vio();
  REQUIRE(feed(vio, ride, 0, 20).states.size() == 20);
  SensorPacket packet = ride.packet(20);
  packet.imu[3].gyro.x() = std::numeric_limits<double>::quiet_NaN();
  packet.imu[5].stamp -= 100 * Ride::kFrameStep;
  packet.imu[7].stamp += 1000 * Ride::kFrameStep;
  packet.imu[8].accel.z() = std::numeric_limits<double>::infinity();
  packet.imu[9].gyro.y() = 1e300;
  const VioResult result = vio.process(packet);
  CHECK(result.problem == VioProblem::kBadSamples);
  CHECK(vio.statistics().refused_samples == 5);
  REQUIRE(result.states.size() == 1);
  CHECK(result.states[0].T_odom_body.translation().norm() < 1e-3);
  CHECK(feed(vio, ride, 21, 30).states.size() == 9);
}

TEST_CASE("Images carry the pose over a gap in the inertial samples") {
  Ride ride;
  Vio vio = ride.vio();
  const VioResult before = feed(vio, ride, 0, 30);
  VioResult gap;
  for (int k = 30; k < 40; ++k) {
    SensorPacket packet = ride.packet(k);
    packet.imu = {ride.packet(29).imu.back(), ride.packet(40).imu.front()};
    const VioResult result = vio.process(packet);
    CHECK(result.problem == VioProblem::kInertialGap);
    REQUIRE(result.states.size() == 1);
    const SE3 moved = before.states.back().T_odom_body.inverse() * result.states[0].T_odom_body;
    CHECK(moved.translation().norm() < 5e-3);
    CHECK(angle_of(moved.linear()) < 5e-3);
  }
  CHECK(feed(vio, ride, 40, 60).problem == VioProblem::kNone);
  CHECK(vio.statistics().gaps == 1);
  CHECK(vio.statistics().starts == 1);
}

TEST_CASE("A long gap in the inertial samples leads to a new start from the last pose") {
  Ride ride;
  Vio vio = ride.vio();
  const VioResult before = feed(vio, ride, 0, 30);
  SensorPacket gap = ride.packet(100);  // 3.5 s later
  const VioResult at_gap = vio.process(gap);
  CHECK(at_gap.problem == VioProblem::kInertialGap);
  CHECK(at_gap.states.empty());
  const VioResult after = feed(vio, ride, 101, 101 + Ride::kStartImages);
  CHECK(vio.statistics().gaps == 1);
  CHECK(vio.statistics().starts == 2);
  REQUIRE(after.states.size() == 1 + Ride::kStartImages);  // includes the images held back
  CHECK(after.states.front().stamp == gap.frame->stamp);
  const SE3 jump = before.states.back().T_odom_body.inverse() * after.states.front().T_odom_body;
  CHECK(jump.translation().norm() < 5e-3);
  CHECK(angle_of(jump.linear()) < 5e-3);
  // The chain of keyframes makes the same step as live odometry, although the two have diverged.
  const SE3 chain_jump =
      before.frames.back().T_odom_body.inverse() * after.frames.front().T_odom_body;
  CHECK((chain_jump.matrix() - jump.matrix()).norm() < 1e-9);
  // The step across the gap has a large covariance.
  REQUIRE_FALSE(after.keyframes.empty());
  CHECK(after.keyframes.front().id.index == before.keyframes.back().id.index + 1);
  CHECK(after.keyframes.front().covariance(5, 5) > 0.1);
}

TEST_CASE("After a long pause of the images odometry starts again from the last pose") {
  constexpr int kPause = 13 * 60 * 20;  // 13 minutes in images at 20 Hz
  const bool are_in_one_packet = GENERATE(true, false);
  CAPTURE(are_in_one_packet);
  Ride ride;
  Vio vio = ride.vio();
  const VioResult before = feed(vio, ride, 0, 30);
  SensorPacket first_after = ride.packet(30 + kPause);
  if (are_in_one_packet)
    first_after.imu = ride.samples(29, 30 + kPause);
  else
    for (int k = 29; k < 29 + kPause; ++k)
      CHECK(vio.process({nullptr, ride.samples(k, k + 1)}).problem == VioProblem::kNoImage);
  CHECK(vio.process(first_after).problem == VioProblem::kPause);
  const VioResult after = feed(vio, ride, 31 + kPause, 31 + kPause + Ride::kStartImages);
  CHECK(after.problem == VioProblem::kNone);
  CHECK(vio.statistics().starts == 2);
  CHECK(vio.statistics().gaps == 0);
  CHECK(vio.statistics().refused_samples == 0);
  REQUIRE(after.states.size() == 1 + Ride::kStartImages);  // includes the images held back
  const SE3 jump = before.states.back().T_odom_body.inverse() * after.states.front().T_odom_body;
  CHECK(jump.translation().norm() < 5e-3);
}

TEST_CASE("Odometry starts at once from a keyframe of an earlier process") {
  Ride ride;
  Vio former = ride.restless();
  const VioResult before = feed(former, ride, 0, 60);
  const KeyframeOdometry& last = before.keyframes.back();
  const auto image = static_cast<int>(last.stamp / Ride::kFrameStep);
  const OdometryState& state = before.states.at(static_cast<std::size_t>(image));
  REQUIRE(state.stamp == last.stamp);

  Vio vio = ride.restless();
  vio.continue_from({state, last});
  const VioResult first = feed(vio, ride, image, image + 1);
  CHECK(first.start == StartStatus::kContinues);
  CHECK(first.states.empty());  // the state of the keyframe was published before
  REQUIRE(first.frames.size() == 1);
  CHECK((first.frames[0].T_odom_body.matrix() - last.T_odom_kf.matrix()).norm() < 1e-9);
  const VioResult after = feed(vio, ride, image + 1, image + 60);
  REQUIRE(after.states.size() == 59);
  for (const OdometryState& next : after.states) {
    CHECK((state.T_odom_body.inverse() * next.T_odom_body).translation().norm() < 1e-3);
    CHECK((next.gyro_bias - state.gyro_bias).norm() < 1e-4);
  }
  REQUIRE_FALSE(after.keyframes.empty());
  CHECK(after.keyframes.front().id.index == last.id.index + 1);
  CHECK(after.keyframes.front().covariance(5, 5) < 1e-3);
}

TEST_CASE("An impossible motion is detected and odometry starts again") {
  Ride ride;
  Vio vio = ride.vio();
  REQUIRE(feed(vio, ride, 0, 30).states.size() == 30);
  bool diverged = false;
  for (int k = 30; k < 45 && !diverged; ++k) {
    SensorPacket packet = ride.packet(k);
    for (ImuSample& sample : packet.imu) sample.accel = {8e2, -2e2, 1e2};  // stuck at 80 g
    const VioResult result = vio.process(packet);
    diverged = result.problem == VioProblem::kDiverged;
    for (const OdometryState& state : result.states) CHECK(state.T_odom_body.matrix().allFinite());
  }
  REQUIRE(diverged);
  CHECK(vio.statistics().divergences == 1);
  const VioResult after = feed(vio, ride, 46, 46 + 4 * Ride::kStartImages);
  CHECK(vio.statistics().starts == 2);
  REQUIRE_FALSE(after.states.empty());
  CHECK(after.states.back().T_odom_body.translation().norm() < 1.0);
}

TEST_CASE("Poses are finite and covariances valid with any samples") {
  const unsigned seed = GENERATE(range(0U, 8U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const auto chance = [&](double p) { return std::bernoulli_distribution(p)(rng); };
  const auto up_to = [&](double most) {
    return std::uniform_real_distribution<double>(-most, most)(rng);
  };
  Ride ride;
  Vio vio = ride.vio();
  for (int k = 0; k < 60; ++k) {
    SensorPacket packet = ride.packet(k);
    if (chance(0.1)) packet.imu.resize(packet.imu.size() / 2);
    if (chance(0.05)) packet.imu.clear();
    for (ImuSample& sample : packet.imu) {
      if (chance(0.02)) sample.gyro.x() = up_to(99.0);
      if (chance(0.02)) sample.accel.y() = up_to(900.0);
      if (chance(0.01)) sample.accel *= up_to(1e300);
      if (chance(0.01)) sample.stamp += static_cast<Stamp>(up_to(1e9));
    }
    const VioResult result = vio.process(packet);
    for (const OdometryState& state : result.states) CHECK(state.T_odom_body.matrix().allFinite());
    for (const KeyframeOdometry& keyframe : result.keyframes) {
      CHECK(keyframe.T_previous_kf.matrix().allFinite());
      if (keyframe.id.index == 0) continue;
      CHECK(is_covariance(keyframe.covariance));
      CHECK(keyframe.covariance.diagonal().minCoeff() > 0.0);
    }
  }
}

TEST_CASE("Without features odometry waits for images to start with") {
  Ride ride;
  Vio vio = ride.vio();
  VioProblem worst = VioProblem::kNone;
  for (int k = 0; k < 70; ++k) {  // 3.5 s, more than the longest wait for a start
    SensorPacket packet = ride.packet(k);
    auto black = std::make_shared<StereoFrame>(*packet.frame);
    std::fill(black->left.pixels.begin(), black->left.pixels.end(), std::uint8_t{0});
    std::fill(black->right.pixels.begin(), black->right.pixels.end(), std::uint8_t{0});
    packet.frame = black;
    const VioResult result = vio.process(packet);
    CHECK(result.states.empty());
    if (result.problem != VioProblem::kNone) worst = result.problem;
  }
  CHECK(worst == VioProblem::kStartTimeout);
  CHECK(vio.statistics().images_without_pose > 0);
  CHECK_FALSE(feed(vio, ride, 70, 140).states.empty());
}

TEST_CASE("During half a minute at rest the pose does not move and no keyframes are made") {
  Ride ride(Glide{.begin_s = 1e3});
  Vio vio = ride.vio();
  const VioResult result = feed(vio, ride, 0, 600);
  CHECK(result.start == StartStatus::kAtRest);
  CHECK(result.problem == VioProblem::kNone);
  CHECK(vio.statistics().rests == 1);
  // There is a second keyframe if the first leaves the window before the rest is detected.
  CHECK(result.keyframes.size() <= 2);
  CHECK(result.keyframes.back().stamp <= 2'000'000'000);
  REQUIRE(result.states.size() == 600);
  REQUIRE(result.frames.size() == 600);
  const SE3 first = result.states.front().T_odom_body;
  for (const OdometryState& state : result.states) {
    const SE3 T = first.inverse() * state.T_odom_body;
    CHECK(T.translation().norm() < 1e-3);
    CHECK(angle_of(T.linear()) < 2e-3);
  }
  for (const LocatedFrame& frame : result.frames)
    CHECK((first.inverse() * frame.T_odom_body).translation().norm() < 1e-3);
  CHECK(first.linear()(2, 0) == Approx(1.0).margin(1e-4));  // x of the body points upwards
  CHECK((result.states.back().gyro_bias - Ride::kGyroBias).norm() < 2e-3);
}

TEST_CASE("After a rest the next keyframe is measured from the one before it") {
  const Glide glide{.begin_s = 15.0};
  Ride ride(glide);
  Vio vio = ride.vio();
  (void)feed(vio, ride, 0, 300);
  CHECK(vio.statistics().rests == 1);
  const VioResult result = feed(vio, ride, 300, 380);
  REQUIRE(result.states.size() == 80);  // all images have a pose
  REQUIRE(result.keyframes.size() >= 5);
  Stamp before = 0;  // the start's keyframe
  for (const KeyframeOdometry& keyframe : result.keyframes) {
    const SE3 T = ride.T_world_body(before).inverse() * ride.T_world_body(keyframe.stamp);
    CHECK(std::abs(keyframe.T_previous_kf.translation().norm() - T.translation().norm()) < 0.01);
    CHECK(is_covariance(keyframe.covariance));
    // 15 s at rest are no drift.
    CHECK(keyframe.covariance.diagonal().tail<3>().maxCoeff() < 0.015 * 0.015);
    before = keyframe.stamp;
  }
  const SE3 T = result.states.front().T_odom_body.inverse() * result.states.back().T_odom_body;
  CHECK(T.translation().norm() == Approx(glide.distance_m).epsilon(0.02));
}

TEST_CASE("Slow motion does not shorten the trajectory") {
  // 2.5 and 25 mm/s on average
  const auto [distance_m, duration_s] =
      GENERATE(table<double, double>({{0.05, 20.0}, {0.25, 10.0}}));
  constexpr double kMargin_m = 0.01;
  CAPTURE(distance_m);
  Ride ride(Glide{.begin_s = 3.0, .duration_s = duration_s, .distance_m = distance_m});
  Vio vio = ride.vio();
  const VioResult result = feed(vio, ride, 0, static_cast<int>(20.0 * (duration_s + 5.0)));
  for (const OdometryState& state : result.states)
    CHECK(state.T_odom_body.translation().norm() ==
          Approx(ride.T_world_body(state.stamp).translation().norm()).margin(kMargin_m));
  SE3 T = SE3::Identity();
  for (const KeyframeOdometry& keyframe : result.keyframes) T = T * keyframe.T_previous_kf;
  CHECK(T.translation().norm() ==
        Approx(ride.T_world_body(result.keyframes.back().stamp).translation().norm())
            .margin(kMargin_m));
}

TEST_CASE("A speed persists for about a second") {
  CHECK(coasting_s(0.0) == 0.0);
  CHECK(coasting_s(0.1) == Approx(0.05).epsilon(0.05));  // both ends together cover all of the time
  CHECK(coasting_s(2.0) < 1.0);
  CHECK(coasting_s(1e9) == Approx(1.0));
}

TEST_CASE("The covariance across a new start grows with the time without images and the speed") {
  const Matrix6 at_once = restart_covariance();
  CHECK(at_once.isDiagonal());
  CHECK(at_once(2, 2) == Approx(0.09));
  CHECK(at_once(3, 3) == Approx(1.0));
  const Eigen::Vector3d up = Eigen::Vector3d(1.0, 2.0, 2.0) / 3.0;
  const Matrix6 later = restart_covariance({.lasts_s = 4.0, .speed_mps = 1.0, .up_body = up});
  CHECK(is_covariance(later));
  CHECK(up.dot(later.topLeftCorner<3, 3>() * up) == Approx(0.09 + 0.25 * 4.0));
  const Eigen::Vector3d level = up.unitOrthogonal();
  CHECK(level.dot(later.topLeftCorner<3, 3>() * level) == Approx(0.09));
  CHECK(later(4, 4) == Approx(1.0 + 4.0));
  CHECK(restart_covariance({.lasts_s = 4.0})(4, 4) == Approx(1.0 + 1.0));
  const Matrix6 anywhere = restart_covariance({.lasts_s = 1e9, .speed_mps = 30.0, .up_body = up});
  CHECK(is_covariance(anywhere));
  CHECK(anywhere.diagonal().maxCoeff() <= 1e6);
  CHECK(up.dot(anywhere.topLeftCorner<3, 3>() * up) < 4.0);
}

TEST_CASE("Between two runs no turn costs more than 0.05") {
  const auto up = GENERATE(std::optional<Eigen::Vector3d>{},
                           std::optional<Eigen::Vector3d>{Eigen::Vector3d::UnitZ()});
  // The chordal cost kappa |R - R'|^2 is at most 8 kappa.
  CHECK(8.0 * precision_of(unknown_step_covariance(up)).kappa < 0.05);
}

}  // namespace
}  // namespace km
