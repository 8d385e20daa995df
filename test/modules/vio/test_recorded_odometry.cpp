#include "modules/vio/node/vio_node.hpp"
#include "recorded_odometry.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Four seconds of MH_01_easy, which is in motion from the first image on.
const Recording* recording() {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return nullptr;
  static const Recording instance = read_recording(*folder, 0.0, 4.0);
  return &instance;
}

// Runs odometry, which must give every image a pose with one start and without divergence.
OdometryRun run_in_one_piece(const Recording& data) {
  OdometryRun run = run_odometry(data, 0, data.packets.size(), TrackerConfig{}, {});
  REQUIRE(run.states.size() == data.packets.size());
  CHECK(run.statistics.starts == 1);
  CHECK(run.statistics.divergences == 0);
  return run;
}

TEST_CASE("MH_01_easy: every image has a pose, within a centimetre, by stereo and by depth") {
  const Recording* const stereo = recording();
  if (stereo == nullptr) return;
  const bool rgbd = GENERATE(false, true);
  CAPTURE(rgbd);
  Recording data = *stereo;
  if (rgbd) {
    data.packets.resize(60);  // dense stereo is slow
    data = as_rgbd(data);
  }
  const OdometryRun run = run_in_one_piece(data);
  CHECK(run.results[15].start == StartStatus::kInMotion);
  const OdometryErrors errors = odometry_errors(run.states, run.truth);
  CHECK(errors.ate_m < 0.010);  // measured with stereo: 0.005
  CHECK(errors.rpe_deg < 0.2);  // measured with stereo: 0.11
  CHECK(errors.tilt_deg < 1.5);
  CHECK(errors.scale == Approx(1.0).epsilon(0.03));
}

TEST_CASE("MH_01_easy: the same input gives the same states to the last bit") {
  const Recording* const data = recording();
  if (data == nullptr) return;
  const OdometryRun a = run_in_one_piece(*data), b = run_in_one_piece(*data);
  for (std::size_t k = 0; k < a.states.size(); ++k)
    CHECK(a.states[k].T_odom_body.matrix() == b.states[k].T_odom_body.matrix());
}

TEST_CASE("MH_01_easy: over a second without images and samples the body continues at its speed") {
  const Recording* const data = recording();
  if (data == nullptr) return;
  Recording gap = *data;
  const Stamp before = gap.packets[40].frame->stamp, after = gap.packets[61].frame->stamp;
  gap.packets.erase(gap.packets.begin() + 41, gap.packets.begin() + 61);
  gap.T_world_body.erase(gap.T_world_body.begin() + 41, gap.T_world_body.begin() + 61);
  const OdometryRun run = run_odometry(gap, 0, gap.packets.size(), TrackerConfig{}, {});
  CHECK(run.statistics.starts == 2);
  REQUIRE(run.states.size() == gap.packets.size());
  REQUIRE(run.states[40].stamp == before);
  REQUIRE(run.states[41].stamp == after);
  const SE3 truth = run.truth[40].inverse() * run.truth[41];
  const SE3 found = run.states[40].T_odom_body.inverse() * run.states[41].T_odom_body;
  const double way_m = truth.translation().norm();
  const double error_m = (found.translation() - truth.translation()).norm();
  CAPTURE(way_m, error_m);
  CHECK(way_m > 0.15);
  CHECK(error_m < 0.5 * way_m);
  const auto next = std::ranges::find(run.keyframes, after, &KeyframeOdometry::stamp);
  REQUIRE(next != run.keyframes.end());
  CHECK(error_m < 2.0 * std::sqrt(next->covariance(3, 3)));
}

// The velocity after the dark contradicts the images if the time offset is not estimated.
// The prior from the dark would move the pose for seconds more.
TEST_CASE("MH_01_easy: one second after five seconds of black images odometry is accurate again") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  const Recording light = read_recording(*folder, 0.0, 15.0);
  constexpr std::size_t kBack = 200;
  const auto errors_after = [](const Recording& data) {
    const OdometryRun run = run_in_one_piece(data);
    constexpr std::size_t kSecond = 20;
    return odometry_errors(std::span(run.states).subspan(kBack + kSecond),
                           std::span(run.truth).subspan(kBack + kSecond));
  };
  const OdometryErrors undisturbed = errors_after(light);
  const OdometryErrors after = errors_after(darkened(light, kBack - 100, kBack));
  INFO(after.ate_m << " m, undisturbed " << undisturbed.ate_m << " m");
  CHECK(after.ate_m < 1.2 * undisturbed.ate_m);
}

TEST_CASE(
    "MH_01_easy: odometry resumed from a keyframe is as accurate as odometry without "
    "interruption") {
  const Recording* const data = recording();
  if (data == nullptr) return;
  const OdometryRun whole = run_odometry(*data, 0, data->packets.size(), TrackerConfig{}, {});
  const double whole_m = odometry_errors(whole.states, whole.truth).ate_m;
  std::vector<double> ratios;  // to whole_m
  for (std::size_t k = 1; k + 1 < whole.keyframes.size(); ++k) {
    const KeyframeOdometry& keyframe = whole.keyframes[k];
    CAPTURE(k, keyframe.stamp);
    std::size_t image = 0;  // every image has a state
    while (whole.states[image].stamp != keyframe.stamp) ++image;
    const OdometryRun rest = run_odometry(*data, image, data->packets.size(), TrackerConfig{}, {},
                                          VioCheckpoint{whole.states[image], keyframe});
    REQUIRE(rest.states.size() == data->packets.size() - image - 1);
    // The biases and the vertical are not lost.
    const OdometryState &next = rest.states.front(), &same = whole.states[image + 1];
    CHECK((next.gyro_bias - same.gyro_bias).norm() < 1e-3);
    CHECK((next.accel_bias - same.accel_bias).norm() < 0.02);
    CHECK(angle_of(next.T_odom_body.linear().transpose() * same.T_odom_body.linear()) < 3e-3);
    std::vector<OdometryState> states(
        whole.states.begin(), whole.states.begin() + static_cast<std::ptrdiff_t>(image + 1));
    states.insert(states.end(), rest.states.begin(), rest.states.end());
    ratios.push_back(odometry_errors(states, whole.truth).ate_m / whole_m);
    CHECK(ratios.back() < 1.15);  // because of a new window; measured: 1.09 at most
  }
  CHECK(std::accumulate(ratios.begin(), ratios.end(), 0.0) <
        1.05 * static_cast<double>(ratios.size()));
}

TEST_CASE("MH_01_easy: odometry resumed from a keyframe knows the time offset of the run before") {
  const Recording* const data = recording();
  if (data == nullptr) return;
  const double late_s = GENERATE(-0.02, 0.02);
  CAPTURE(late_s);
  const Recording late = delayed(*data, late_s);
  const OdometryRun whole = run_odometry(late, 0, late.packets.size(), TrackerConfig{}, {});
  const std::size_t middle = whole.keyframes.size() / 2;
  const KeyframeOdometry& keyframe = whole.keyframes[middle];
  REQUIRE(keyframe.calibration);
  const auto image = static_cast<std::size_t>(
      std::ranges::find(whole.states, keyframe.stamp, &OdometryState::stamp) -
      whole.states.begin());
  const auto rest_of = [&](const KeyframeOdometry& from) {
    return run_odometry(late, image, late.packets.size(), TrackerConfig{}, {},
                        VioCheckpoint{whole.states[image], from});
  };
  const OdometryRun rest = rest_of(keyframe);
  CHECK(rest.statistics.divergences == 0);
  REQUIRE(rest.keyframes.size() >= 2);
  const UncertainCalibration& next = rest.keyframes.front().calibration.value();
  CHECK(next.calibration.offset_s ==
        Approx(keyframe.calibration->calibration.offset_s).margin(1e-3));
  CHECK(next.covariance(0, 0) < 1.001 * keyframe.calibration->covariance(0, 0));
  KeyframeOdometry forgetful = keyframe;
  forgetful.calibration.reset();
  const UncertainCalibration anew = rest_of(forgetful).keyframes.front().calibration.value();
  CHECK(next.covariance(0, 0) < anew.covariance(0, 0));
}

TEST_CASE("V1_01_easy: a minute at rest, rotors idling") {
  const auto folder = shared_data("euroc/V1_01_easy");
  if (!folder) return;
  const Recording data = standing_recording(*folder, 60.0);
  REQUIRE(data.packets.size() == 301);
  const OdometryRun run = run_in_one_piece(data);
  CHECK(run.statistics.rests >= 1);
  CHECK(run.keyframes.size() <= 2);  // without rest one every two seconds
  for (const OdometryState& state : run.states) {
    CHECK(state.T_odom_body.translation().norm() < 5e-3);
    CHECK(angle_of(state.T_odom_body.linear().transpose() *
                   run.states.front().T_odom_body.linear()) < 5e-3);
    CHECK(state.v_odom.norm() < 0.02);
  }
}

TEST_CASE("MH_01_easy: a body set down stays there whatever the images show") {
  // It moves until 15.5 s. From 16 s on there is an image a second.
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  const Recording data = read_recording(*folder, 12.0, 26.5);
  const OdometryRun run = run_in_one_piece(data);
  CHECK(run.statistics.rests == 1);
  CHECK(run.keyframes.back().stamp < data.packets[81].frame->stamp);  // 17 s
  const SE3 there = run.states.back().T_odom_body;
  for (std::size_t k = 82; k < run.states.size(); ++k)
    CHECK((there.inverse() * run.states[k].T_odom_body).translation().norm() < 1e-3);
}

TEST_CASE("The odometry node publishes the results of odometry in order of time") {
  const Recording* const data = recording();
  if (data == nullptr) return;
  Topic<SensorPacket> packets;
  Topic<OdometryState> odometry;
  Topic<KeyframeOdometry> keyframes;
  Topic<LocatedFrame> frames;
  Topic<VioStatistics> statistics;
  std::vector<Stamp> stamps;  // written by the node's thread, read after it has ended
  std::vector<std::uint32_t> indices;
  std::vector<LocatedFrame> located;
  odometry.subscribe([&](const auto& state) { stamps.push_back(state->stamp); });
  keyframes.subscribe([&](const auto& keyframe) { indices.push_back(keyframe->id.index); });
  frames.subscribe([&](const auto& frame) { located.push_back(*frame); });
  Topic<TrackedImage> images;
  std::vector<TrackedImage> tracked;
  images.subscribe([&](const auto& image) { tracked.push_back(*image); });
  Topic<ProcessedFrame> processed;
  std::vector<ProcessedFrame> finished;
  processed.subscribe([&](const auto& frame) { finished.push_back(*frame); });
  VioNode node(Vio(5, data->rig, {}, {}), {.packets = packets,
                                           .odometry = odometry,
                                           .keyframes = keyframes,
                                           .frames = frames,
                                           .statistics = statistics,
                                           .images = images,
                                           .processed = processed});
  node.start();
  for (std::size_t k = 0; k < 40; ++k) packets.publish(data->packets[k]);
  node.stop();  // drains the queue
  CHECK(node.error() == nullptr);
  CHECK(stamps.size() == 40);
  REQUIRE(finished.size() == 40);
  CHECK_FALSE(finished[0].tracked_share);  // the first image has none before it
  for (std::size_t k = 0; k < finished.size(); ++k) {
    CHECK(finished[k].stamp == data->packets[k].frame->stamp);
    if (k > 0) CHECK(finished[k].tracked_share.value_or(0.0) > 0.6);
    CHECK(finished[k].tracked_share.value_or(1.0) <= 1.0);
  }
  CHECK(std::is_sorted(stamps.begin(), stamps.end()));
  REQUIRE(indices.size() >= 2);
  for (std::size_t k = 0; k < indices.size(); ++k) CHECK(indices[k] == k);
  REQUIRE(located.size() == stamps.size());
  for (std::size_t k = 0; k < stamps.size(); ++k) CHECK(located[k].frame->stamp == stamps[k]);
  CHECK(located.back().keyframe == indices.back());
  CHECK(tracked.size() == 40);
}

}  // namespace
}  // namespace km
