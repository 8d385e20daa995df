#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/vio/external_odometry.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kPeriod_s = 0.1;

SensorPacket packet(int index, const SE3& T_odom_body,
                    const Matrix6& covariance = Matrix6::Zero()) {
  StereoFrame frame;
  frame.stamp = nanoseconds(100.0 + kPeriod_s * index);
  return {std::make_shared<const StereoFrame>(std::move(frame)),
          {},
          MeasuredPose{T_odom_body, covariance}};
}

SE3 ahead(double x_m) {
  return make_pose(Eigen::Matrix3d::Identity(), {x_m, 0, 0});
}

VioConfig some_config() {
  VioConfig config{.output_interval_s = 0.3,
                   .output_distance_m = 0.25,
                   .output_rest_interval_s = 2.0,
                   .drift_rotation = 1e-3,
                   .drift_translation = 1e-2};
  return config;
}

struct Run {
  ExternalOdometry odometry{3, DepthSource::kRightImage, some_config()};
  std::vector<OdometryState> states = {};
  std::vector<KeyframeOdometry> keyframes = {};
  std::vector<LocatedFrame> frames = {};
  int jumps = 0;

  void add(const SensorPacket& packet) {
    const VioResult result = odometry.process(packet);
    std::ranges::copy(result.states, std::back_inserter(states));
    std::ranges::copy(result.keyframes, std::back_inserter(keyframes));
    std::ranges::copy(result.frames, std::back_inserter(frames));
    jumps += result.problem == VioProblem::kJumped ? 1 : 0;
  }
};

TEST_CASE("Poses of an external odometry are published with keyframes by time and distance") {
  Run run;
  for (int k = 0; k < 40; ++k) run.add(packet(k, ahead(0.05 * std::min(k, 20))));
  REQUIRE(run.states.size() == 40);
  REQUIRE(run.frames.size() == 40);
  CHECK(run.states[7].T_odom_body.isApprox(ahead(0.35)));
  CHECK(run.states[7].v_odom.isApprox(Eigen::Vector3d(0.5, 0, 0), 1e-9));
  CHECK(run.states[30].v_odom.isZero());
  // Every 0.25 m, which is 5 images.
  std::vector<Stamp> expected;
  for (const int k : {0, 5, 10, 15, 20}) expected.push_back(nanoseconds(100.0 + kPeriod_s * k));
  std::vector<Stamp> stamps;
  for (const KeyframeOdometry& keyframe : run.keyframes) stamps.push_back(keyframe.stamp);
  CHECK(stamps == expected);
  for (std::size_t k = 0; k < run.keyframes.size(); ++k) {
    const KeyframeOdometry& keyframe = run.keyframes[k];
    CHECK(keyframe.id.robot == 3);
    CHECK(keyframe.id.index == k);
    CHECK(!keyframe.vertical);
    if (k > 0)
      CHECK((run.keyframes[k - 1].T_odom_kf * keyframe.T_previous_kf)
                .isApprox(keyframe.T_odom_kf, 1e-12));
  }
  CHECK(run.frames[7].keyframe == 1);
  CHECK(run.frames[7].T_odom_body.isApprox(ahead(0.35)));
  CHECK(run.jumps == 0);
}

TEST_CASE("A body that trembles stands still and one that creeps does not") {
  Run trembling, creeping;
  constexpr double kSpeed_mps = 0.005;
  for (int k = 0; k <= 600; ++k) {
    trembling.add(packet(k, ahead(k % 2 == 0 ? 0.0 : 0.0005)));
    creeping.add(packet(k, ahead(kSpeed_mps * kPeriod_s * k)));
  }
  CHECK(trembling.keyframes.size() == 1);
  // 2 s at 1 cm/s, which takes 4 s.
  REQUIRE(creeping.keyframes.size() >= 2);
  CHECK(seconds_between(creeping.keyframes[0].stamp, creeping.keyframes[1].stamp) == Approx(4.0));
  CHECK(creeping.keyframes[1].covariance(3, 3) == Approx(2.0 * 1e-4));
}

TEST_CASE("A keyframe's covariance is the growth of the odometry's covariance plus drift") {
  const Matrix6 step = (Vector6() << 1e-6, 2e-6, 3e-6, 4e-4, 5e-4, 6e-4).finished().asDiagonal();
  const SE3 motion = se3_exp((Vector6() << 0.02, -0.01, 0.1, 0.3, 0.02, -0.01).finished());
  const bool grows = GENERATE(true, false);
  CAPTURE(grows);
  Run run;
  UncertainPose pose{se3_exp((Vector6() << 0.1, 0.2, 0.3, 1, 2, 3).finished()), step};
  for (int k = 0; k < 30; ++k) {
    run.add(packet(k, pose.T, pose.Sigma));
    pose = compose(pose, {motion, grows ? step : Matrix6::Zero()});
    if (!grows) pose.Sigma = step;
  }
  REQUIRE(run.keyframes.size() == 10);  // every 0.3 s
  Matrix6 expected = Matrix6::Zero();
  if (grows) {
    const UncertainPose one{motion, step};
    expected = compose(compose(one, one), one).Sigma;
  }
  expected.diagonal().head<3>().array() += 0.3 * 1e-6;
  expected.diagonal().tail<3>().array() += 0.3 * 1e-4;
  // A covariance that is constant in the body's axes leaves only rounding and the rotation of the
  // axes.
  if (grows) CHECK(run.keyframes[5].covariance.isApprox(expected, 1e-5));
  CHECK(is_covariance(run.keyframes[5].covariance));
  CHECK(
      (run.keyframes[5].covariance.diagonal().array() >= expected.diagonal().array() * (1.0 - 1e-5))
          .all());
}

TEST_CASE("An odometry that jumps leaves the body where it was") {
  Run run;
  for (int k = 0; k < 8; ++k) run.add(packet(k, ahead(0.05 * k)));
  for (int k = 8; k < 16; ++k) run.add(packet(k, ahead(100.0 + 0.05 * k)));
  CHECK(run.jumps == 1);
  REQUIRE(run.states.size() == 16);
  CHECK(run.states[8].T_odom_body.isApprox(ahead(0.35), 1e-9));
  CHECK(run.states[15].T_odom_body.isApprox(ahead(0.70), 1e-9));
  REQUIRE(run.keyframes.size() == 4);  // 0, 5, the jump at 8, 13
  CHECK(run.keyframes[2].stamp == run.states[8].stamp);
  CHECK(run.keyframes[2].covariance(3, 3) == 1.0);
  CHECK(run.keyframes[3].covariance(3, 3) < 1e-3);
}

TEST_CASE("Packets without a pose, and images out of order, give nothing") {
  Run run;
  SensorPacket none = packet(0, ahead(0));
  none.pose.reset();
  run.add(none);
  CHECK(run.frames.empty());
  run.add(packet(3, ahead(0)));
  run.add(packet(3, ahead(0)));
  run.add(packet(2, ahead(0)));
  SE3 broken = ahead(0);
  broken.translation().x() = std::nan("");
  run.add(packet(4, broken));
  CHECK(run.frames.size() == 1);
  CHECK(run.keyframes.size() == 1);
}

TEST_CASE("An external odometry continues after a keyframe") {
  Run whole, first, second;
  const auto at = [](int k) {
    return packet(k, ahead(0.05 * k), 1e-4 * (k + 1) * Matrix6::Identity());
  };
  for (int k = 0; k < 30; ++k) whole.add(at(k));
  for (int k = 0; k < 12; ++k) first.add(at(k));
  REQUIRE(first.keyframes.size() == 3);
  second.odometry.continue_from({first.states[10], first.keyframes[2]});
  for (int k = 10; k < 30; ++k) second.add(at(k));
  REQUIRE(second.keyframes.size() == whole.keyframes.size() - 3);
  CHECK(second.frames.size() == 20);
  CHECK(second.states.size() == 19);  // the state of the keyframe has been published
  for (std::size_t k = 0; k < second.keyframes.size(); ++k) {
    const KeyframeOdometry &a = second.keyframes[k], &b = whole.keyframes[k + 3];
    CHECK(a.id.index == b.id.index);
    CHECK(a.stamp == b.stamp);
    CHECK(a.T_previous_kf.isApprox(b.T_previous_kf, 1e-12));
    CHECK(a.covariance.isApprox(b.covariance, 1e-9));
  }
}

}  // namespace
}  // namespace km
