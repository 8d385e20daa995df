#include "modules/core/geometry/lie.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"
#include "synthetic_motion.hpp"
#include "test/support/numeric_jacobian.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kDerivative = 1e-6;  // entries are about 1

TEST_CASE("Derivatives of the pose at an image agree with differences") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  OdometryState state{.T_odom_body = retract(SE3::Identity(), random_vector<6>(rng)),
                      .v_odom = random_vector<3>(rng),
                      .gyro_bias = 0.1 * random_vector<3>(rng)};
  const Eigen::Vector3d gyro = random_vector<3>(rng);
  constexpr double kShift_s = 0.03;
  const ImagePose image = ImagePose::at(state, gyro, kShift_s);
  const Eigen::MatrixXd by_state = numeric_jacobian<6>([&](const Vector6& d) -> Eigen::VectorXd {
    OdometryState moved = state;
    moved.T_odom_body = retract(state.T_odom_body, d);
    return local_coordinates(image.T_odom_body, ImagePose::at(moved, gyro, kShift_s).T_odom_body);
  });
  Matrix6 expected = Matrix6::Zero();
  expected.topLeftCorner<3, 3>() = expected.bottomRightCorner<3, 3>() = image.by_state;
  CHECK((by_state - expected).norm() < kDerivative);
  using Vector1 = Eigen::Matrix<double, 1, 1>;
  const Eigen::MatrixXd by_offset = numeric_jacobian<1>([&](const Vector1& d) -> Eigen::VectorXd {
    return local_coordinates(image.T_odom_body,
                             ImagePose::at(state, gyro, kShift_s + d(0)).T_odom_body);
  });
  CHECK((by_offset - image.by_calibration.leftCols<1>()).norm() < kDerivative);
}

TEST_CASE("Derivatives of a reprojection by the calibration agree with differences") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  Window window;
  window.calibrates = true;
  for (std::size_t c = 0; c < 2; ++c)
    window.rig_views[c] = view_model(synthetic_rig().stereo.cameras[c], 0.7);
  CameraCalibration calibration{
      .offset_s = 0.02, .T_body_rig = retract(SE3::Identity(), 0.05 * random_vector<6>(rng))};
  calibrate(window, calibration);
  const SyntheticMotion motion;
  WindowFrame& frame = window.frames.emplace_back();
  frame.state = motion.state(1'000'000'000);
  frame.gyro = motion.sample(1'000'000'000).gyro;
  frame.offset_s = 0.01;
  const Eigen::Vector3d p_odom = frame.state.T_odom_body * Eigen::Vector3d(3.0, 0.2, -0.4);
  WindowObservation seen;
  seen.bearings = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  seen.by_readout = {random_vector<2>(rng), random_vector<2>(rng)};
  window.landmarks.emplace_back().observations = {seen};
  for (const std::size_t c : {0U, 1U}) {
    const ImagePose image = image_pose(window, frame, frame.state);
    ReprojectionTerm term;
    REQUIRE(linearize_reprojection(window.views[c], Eigen::Vector2d::Zero(), image.T_odom_body,
                                   image.T_odom_body, p_odom, term));
    const Eigen::MatrixXd numeric =
        numeric_jacobian<kCalibrationSize>([&](const CalibrationVector& d) -> Eigen::VectorXd {
          Window moved = window;
          calibrate(moved, calibration.retracted(d));
          Eigen::Vector2d r;
          REQUIRE(reprojection_error(moved.views[c],
                                     *moved.landmarks[0].observations[0].bearings[c],
                                     image_poses(moved)[0], p_odom, r));
          return r;
        });
    Eigen::Matrix<double, 2, kCalibrationSize> analytic;
    analytic << term.J_pose * image.by_calibration, window.views[c].weight * seen.by_readout[c];
    CHECK((analytic - numeric).norm() < 1e-5 * numeric.norm());
  }
}

// Twelve seconds of a motion, with inertial samples stamped `late_s` too late.
std::vector<InertialFrame> late_frames(SyntheticWorld& world, Stamp late) {
  auto frames = world.frames(240, 0.5);
  for (InertialFrame& frame : frames)
    for (ImuSample& sample : frame.samples) {
      const Stamp stamp = sample.stamp;
      sample = world.motion().sample(stamp - late);
      sample.stamp = stamp;
    }
  return frames;
}

// Calibration of a smoother after `frames`, started on the first 16 from their true states.
UncertainCalibration estimated(const std::vector<InertialFrame>& frames,
                               const SyntheticWorld& world) {
  constexpr std::size_t kStart = 16;
  VioConfig config{.gravity_mps2 = kGravity_mps2};
  FixedLagSmoother smoother(synthetic_rig(), motion_model(synthetic_rig(), config));
  REQUIRE(smoother.start(std::span(frames).first(kStart), world.states(kStart)));
  for (std::size_t k = kStart; k < frames.size(); ++k)
    CHECK(smoother.add(frames[k]).solution.usable);
  return smoother.calibration();
}

TEST_CASE("A time offset of the stamps is estimated") {
  const Stamp late = GENERATE(-30'000'000, 0, 10'000'000, 30'000'000);
  CAPTURE(late);
  SyntheticWorld world(SyntheticMotion{}, 21);
  const auto [calibration, covariance] = estimated(late_frames(world, late), world);
  CHECK(calibration.offset_s == Approx(seconds_between(0, late)).margin(5e-4));
  CHECK(std::sqrt(covariance(0, 0)) < 1e-3);  // 0.7 ms with the modelled noise
  CHECK(angle_of(calibration.T_body_rig.linear()) < 2e-3);
}

// Twelve seconds of a motion, seen by rolling shutters of this readout time.
std::vector<InertialFrame> rolled_frames(SyntheticWorld& world, double readout_s) {
  constexpr Stamp kSoon = 1'000'000;
  auto frames = late_frames(world, 0);
  for (InertialFrame& frame : frames) {
    const Stamp stamp = frame.tracked.stamp;
    std::map<std::uint64_t, TrackedFeature> soon;
    for (const TrackedFeature& feature : world.frame(stamp, stamp + kSoon).tracked.features)
      soon[feature.id] = feature;
    const auto roll = [&](const Eigen::Vector2d& now, const Eigen::Vector2d& then) {
      const Camera camera = synthetic_rig().stereo.cameras[0];
      const double share = now.y() * camera.fy / camera.height;
      return Eigen::Vector2d(share * (then - now) / seconds_between(0, kSoon));
    };
    for (TrackedFeature& feature : frame.tracked.features) {
      const auto then = soon.find(feature.id);
      if (then == soon.end()) continue;
      feature.left_by_readout = roll(feature.left, then->second.left);
      feature.left += readout_s * feature.left_by_readout;
      if (!feature.right || !then->second.right) continue;
      feature.right_by_readout = roll(*feature.right, *then->second.right);
      *feature.right += readout_s * feature.right_by_readout;
    }
  }
  return frames;
}

TEST_CASE("The readout time of a rolling shutter is estimated") {
  const double readout_s = GENERATE(-0.01, 0.0, 0.015, 0.03);
  CAPTURE(readout_s);
  SyntheticWorld world(SyntheticMotion{}, 23);
  const auto [calibration, covariance] = estimated(rolled_frames(world, readout_s), world);
  CHECK(calibration.readout_s == Approx(readout_s).margin(5e-4));
  CHECK(std::sqrt(covariance(7, 7)) < 1e-3);
  CHECK(std::abs(calibration.offset_s) < 5e-4);
  CHECK(angle_of(calibration.T_body_rig.linear()) < 2e-3);
}

}  // namespace
}  // namespace km
