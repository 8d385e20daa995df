#include "modules/vio/motion_model.hpp"

#include "modules/vio/residuals.hpp"
#include "recorded_odometry.hpp"
#include "synthetic_motion.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Stamp kStep = 100'000'000;

VioConfig without_imu() {
  SensorRig rig;
  rig.has_imu = false;
  return motion_model(rig, {}).config;
}

ImuPreintegration virtual_preintegration(Stamp to) {
  const VioConfig config = without_imu();
  const MotionNoise noise{.accel = config.motion_accel, .turn = config.motion_turn};
  ImuPreintegration imu(virtual_imu_noise(noise, seconds_between(0, to)), Eigen::Vector3d::Zero(),
                        Eigen::Vector3d::Zero());
  REQUIRE(imu.add(virtual_samples(0, to), 0, to));
  return imu;
}

TEST_CASE("A motion at constant velocity and angular rate has no error under the prior") {
  std::mt19937 rng(5);
  const Eigen::Vector3d rate = random_vector<3>(rng), velocity = 3.0 * random_vector<3>(rng);
  OdometryState i, j;
  i.T_odom_body = random_pose(rng);
  i.v_odom = j.v_odom = velocity;
  i.gyro_bias = j.gyro_bias = -rate;
  const double dt = seconds_between(0, kStep);
  j.T_odom_body = make_pose(i.T_odom_body.linear() * so3_exp(dt * rate),
                            i.T_odom_body.translation() + dt * velocity);
  const ImuFactor factor = ImuFactor::of(virtual_preintegration(kStep), 0.0).value();
  CHECK(factor.error(i, j).norm() < 1e-6);
  const OdometryState predicted = predict(i, factor.imu(), 0.0);
  CHECK(predicted.T_odom_body.isApprox(j.T_odom_body, 1e-9));
  CHECK(predicted.v_odom.isApprox(velocity));
}

TEST_CASE("Images alone determine the motion from exact tracks") {
  SyntheticWorld world(SyntheticMotion{}, 7);
  SensorRig rig = synthetic_rig();
  rig.has_imu = false;
  FixedLagSmoother smoother(rig, motion_model(rig, {}));
  std::vector<InertialFrame> frames = world.frames(40);
  for (std::size_t k = 1; k < frames.size(); ++k)
    frames[k].samples = virtual_samples(frames[k - 1].tracked.stamp, frames[k].tracked.stamp);
  frames[0].samples.clear();
  // The tracker's motion is where the optimisation begins, and no measurement.
  std::mt19937 rng(11);
  const SE3 T_body_cam = rig.stereo.cameras[0].T_body_cam;
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const auto pose = [&](std::size_t i) {
      return world.motion().state(frames[i].tracked.stamp).T_odom_body * T_body_cam;
    };
    frames[k].tracked.T_previous_current =
        pose(k - 1).inverse() * pose(k) * se3_exp(2e-3 * random_vector<6>(rng));
  }
  OdometryState first = world.motion().state(0);
  first.v_odom.setZero();  // unknown to odometry
  REQUIRE(smoother.start({frames.data(), 1}, {&first, 1}));
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const SmootherUpdate update = smoother.add(frames[k]);
    REQUIRE(update.solution.usable);
    const OdometryState truth = world.motion().state(frames[k].tracked.stamp);
    const SE3 error = truth.T_odom_body.inverse() * update.state.T_odom_body;
    CAPTURE(k);
    CHECK(error.translation().norm() < 2e-3);  // the prior pulls by less
    CHECK(angle_of(error.linear()) < 1e-3);
    CHECK(update.state.accel_bias.norm() < 1e-6);
  }
}

const Recording* recording(const std::string& name, double to_s) {
  const auto folder = shared_data(name);
  if (!folder) return nullptr;
  static std::map<std::string, Recording> recordings;
  return &recordings.try_emplace(name, read_recording(*folder, 0.0, to_s, false)).first->second;
}

TEST_CASE("KITTI: images alone give every image a pose, within a percent of the path") {
  const Recording* const data = recording("kitti_sequence_1", 10.0);
  if (data == nullptr) return;
  const OdometryRun run = run_odometry(*data, 0, data->packets.size(), {}, {});
  REQUIRE(run.states.size() == data->packets.size());
  CHECK(run.results[0].start == StartStatus::kByImages);
  CHECK(run.statistics.starts == 1);
  const SE3& first = run.states.front().T_odom_body;  // x of odom is the viewing direction
  CHECK((first * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  const SE3 T = run.states.front().T_odom_body.inverse() * run.states.back().T_odom_body;
  const SE3 truth = run.truth.front().inverse() * run.truth.back();
  constexpr double kPath_m = 59.9;
  CHECK((T.translation() - truth.translation()).norm() < 0.01 * kPath_m);
  REQUIRE(run.keyframes.size() > 10);
  for (const KeyframeOdometry& keyframe : run.keyframes) {
    CHECK_FALSE(keyframe.vertical);
    CHECK_FALSE(keyframe.calibration);
  }
}

TEST_CASE(
    "Images alone: a loss of vision is extrapolated for a second, then odometry starts again") {
  const Recording* const data = recording("euroc/MH_01_easy", 4.0);
  if (data == nullptr) return;
  const std::size_t first = 30, last = GENERATE(as<std::size_t>(), 38, 60);  // 0.4 s and 1.5 s
  CAPTURE(last);
  const bool is_long = last == 60;
  const OdometryRun run =
      run_odometry(darkened(*data, first, last), 0, data->packets.size(), {}, {});
  CHECK(run.statistics.vision_losses == 1);
  CHECK(run.statistics.starts == (is_long ? 2 : 1));
  CHECK((run.statistics.images_without_pose > 0) == is_long);
  double largest_m = 0.0;
  for (const KeyframeOdometry& keyframe : run.keyframes)
    largest_m = std::max(largest_m, std::sqrt(keyframe.covariance(3, 3)));
  CHECK(largest_m > (is_long ? 0.5 : 0.05));  // at other times a centimetre
  for (std::size_t k = 1; k < run.keyframes.size(); ++k)
    CHECK(run.keyframes[k].id.index == run.keyframes[k - 1].id.index + 1);
  CHECK(run.states.back().stamp == data->packets.back().frame->stamp);
}

TEST_CASE("The noise of the shown motion is that of a random walk of both speeds") {
  constexpr double kAccel = 0.5, kTurn = 0.8, kStep_s = 0.05;
  std::mt19937 rng(3);
  ShownMotion shown;
  const MotionNoise most{.accel = 10.0, .turn = 5.0};
  CHECK(shown.noise(most).accel == most.accel);
  OdometryState now;
  for (int k = 0; k < 400; ++k) {
    const OdometryState before = now;
    now.stamp += nanoseconds(kStep_s);
    now.v_odom += std::sqrt(kStep_s) * kAccel * random_vector<3>(rng);
    now.gyro_bias += std::sqrt(kStep_s) * kTurn * random_vector<3>(rng);
    shown.add(before, now, kStep_s);
  }
  // The mean of 3 s has 180 degrees of freedom: 5 % of the deviation, here four times as much.
  CHECK(shown.noise(most).accel == Approx(ShownMotion::kCaution * kAccel).epsilon(0.2));
  CHECK(shown.noise(most).turn == Approx(ShownMotion::kCaution * kTurn).epsilon(0.2));
  CHECK(shown.noise({.accel = 0.1, .turn = 0.1}).accel == 0.1);
}

// Images 10 to 12 show a blank wall.
TEST_CASE("TartanAir: a blank wall is a loss of vision, bridged within the stated uncertainty") {
  const Recording* const data = recording("tartanair_hospital", 3.0);
  if (data == nullptr) return;
  const OdometryRun run = run_odometry(*data, 0, data->packets.size(), {}, {});
  REQUIRE(run.states.size() == data->packets.size());
  CHECK(run.statistics.vision_losses == 1);
  CHECK(run.statistics.blind_s == Approx(0.2));
  for (std::size_t k = 1; k < run.states.size(); ++k) {
    const SE3 step = run.states[k - 1].T_odom_body.inverse() * run.states[k].T_odom_body;
    const SE3 truth = run.truth[k - 1].inverse() * run.truth[k];
    CAPTURE(k);
    CHECK((step.translation() - truth.translation()).norm() < 0.02);  // wrong tracks: 0.19
    CHECK(angle_of(step.linear().transpose() * truth.linear()) < 0.01);
  }
  double usual_m = 1.0, largest_m = 0.0;
  for (std::size_t k = 1; k < run.keyframes.size(); ++k) {
    const double sigma_m = std::sqrt(run.keyframes[k].covariance.bottomRightCorner<3, 3>().trace());
    usual_m = std::min(usual_m, sigma_m);
    largest_m = std::max(largest_m, sigma_m);
  }
  CHECK(largest_m > 3.0 * usual_m);
}

TEST_CASE("ZED 2: odometry does not jump against the motion of the tracks") {
  const Recording* const data = recording("zed2_clips/desk_c", 6.0);
  if (data == nullptr) return;
  FeatureTracker tracker(data->rig.stereo, {}, false);
  const OdometryRun run = run_odometry(*data, 0, data->packets.size(), {}, {});
  REQUIRE(run.states.size() == data->packets.size());
  for (std::size_t k = 0; k < run.states.size(); ++k) {
    const auto motion =
        tracker.track(*data->packets[k].frame, Eigen::Matrix3d::Identity()).T_previous_current;
    if (!motion) continue;
    const SE3 step = run.states[k - 1].T_odom_body.inverse() * run.states[k].T_odom_body;
    CAPTURE(k);
    // Keyframes with few common landmarks: 0.057 m.
    CHECK(std::abs(step.translation().norm() - motion->translation().norm()) < 0.02);
  }
}

}  // namespace
}  // namespace km
