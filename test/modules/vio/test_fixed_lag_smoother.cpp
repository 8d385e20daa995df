#include <Eigen/LU>

#include "modules/core/geometry/lie.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/gyro_noise_scale.hpp"
#include "modules/vio/window_optimizer.hpp"
#include "synthetic_motion.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kStartImages = 15;

struct Run {
  FixedLagSmoother smoother;
  std::vector<OdometryState> states;
  std::vector<SmootherUpdate> updates;
};

VioConfig gaussian_config() {
  VioConfig config{
      .noise_px = 0.5, .loss_scale = 1e3, .outlier_px = 10.0, .gravity_mps2 = kGravity_mps2};
  return config;
}

// Smooths `frames` from a guess that is off by `guess_error`.
Run run_smoother(const std::vector<InertialFrame>& frames, const SyntheticWorld& world,
                 double guess_error, const VioConfig& config) {
  Run run{FixedLagSmoother(synthetic_rig(), motion_model(synthetic_rig(), config)), {}, {}};
  std::mt19937 rng(99);
  std::vector<OdometryState> guess = world.states(kStartImages);
  for (std::size_t k = 1; k < guess.size(); ++k) {
    guess[k].T_odom_body = retract(guess[k].T_odom_body, guess_error * random_vector<6>(rng));
    guess[k].v_odom += guess_error * random_vector<3>(rng);
  }
  const auto started = run.smoother.start(std::span(frames).first(kStartImages), guess);
  REQUIRE(started);
  run.states = *started;
  for (std::size_t k = kStartImages; k < frames.size(); ++k) {
    run.updates.push_back(run.smoother.add(frames[k]));
    run.states.push_back(run.updates.back().state);
  }
  return run;
}

double position_error(const OdometryState& state, const SyntheticWorld& world) {
  return (state.T_odom_body.translation() -
          world.motion().position(seconds_between(0, state.stamp)))
      .norm();
}

TEST_CASE("Biases and a varied motion are estimated from exact data") {
  SyntheticMotion motion;
  motion.gyro_bias = {0.01, -0.015, 0.005};
  motion.accel_bias = {0.02, 0.03, -0.02};
  SyntheticWorld world(motion, 2);
  std::vector<InertialFrame> frames = world.frames(100);
  const Run run = run_smoother(frames, world, 0.01, gaussian_config());
  // Samples at 200 Hz are integrated with errors of some micrometres; nothing else is inexact.
  CHECK(position_error(run.states.back(), world) < 1e-3);
  CHECK((run.states.back().gyro_bias - motion.gyro_bias).norm() < 1e-4);
  CHECK((run.states.back().accel_bias - motion.accel_bias).norm() < 1e-2);
}

// Two images from one place determine the direction of a near landmark, and not its distance.
TEST_CASE("A landmark without distance ties the rotations of images, and is no fault") {
  std::mt19937 rng(11);
  for (int k = 0; k < 200; ++k) {
    Window window;
    window.views[0] = view_model(synthetic_rig().stereo.cameras[0], 0.7);
    const SE3 T_odom_body = random_pose(rng, 100.0);
    const Eigen::Vector3d p_cam = 0.1 * (0.3 * random_vector<2>(rng)).homogeneous();
    WindowLandmark& landmark = window.landmarks.emplace_back();
    landmark.p_odom = T_odom_body * (synthetic_rig().stereo.cameras[0].T_body_cam * p_cam);
    landmark.located = true;
    for (std::size_t frame = 0; frame < 2; ++frame) {
      window.frames.emplace_back().state.T_odom_body = T_odom_body;
      window.frames.back().keyframe = true;
      landmark.observations.push_back({frame, {p_cam.hnormalized(), std::nullopt}});
    }
    WindowEquations equations(window, 0.0);
    equations.add_landmark(landmark, true);
    equations.add_images();
    const Eigen::MatrixXd H = equations.H().selfadjointView<Eigen::Lower>();
    REQUIRE(H.allFinite());
    const auto information = [&](const Vector6& first, const Vector6& second) {
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(30);
      dx.head<6>() = first;
      dx.segment<6>(15) = second;
      return dx.dot(H * dx);
    };
    const double observed = window.views[0].weight * window.views[0].weight;
    Vector6 turn = Vector6::Zero();
    turn.head<3>() = random_vector<3>(rng).normalized();
    CHECK(information(turn, turn) == Approx(0.0).margin(1e-3 * observed));
    ReprojectionTerm term;
    REQUIRE(linearize_reprojection(window.views[0], p_cam.hnormalized(), T_odom_body, T_odom_body,
                                   landmark.p_odom, term));
    const double apart = 2.0 * (term.J_pose * turn).squaredNorm();
    CHECK(information(turn, -turn) == Approx(apart).epsilon(1e-6).margin(1e-3 * observed));
  }
}

// Directions of a common rotation about the vertical and a common shift, as each state sees them.
// They change no measurement.
Eigen::MatrixXd unobservable_directions(const Window& window) {
  const std::vector<FirstEstimate> held = first_estimates(window);
  Eigen::MatrixXd N(15 * static_cast<Eigen::Index>(window.frames.size()), 4);
  N.setZero();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    const OdometryState at = held[k].applied_to(window.frames[k].state);
    const Eigen::Matrix3d R_T = at.T_odom_body.linear().transpose();
    auto rows = N.middleRows<15>(15 * static_cast<Eigen::Index>(k));
    rows.block<3, 1>(0, 0) = R_T * up;
    rows.block<3, 1>(3, 0) = R_T * up.cross(at.T_odom_body.translation());
    rows.block<3, 1>(6, 0) = up.cross(at.v_odom);
    rows.block<3, 3>(3, 1) = R_T;
  }
  return N;
}

TEST_CASE("Marginalisation gives no information on heading and position") {
  // Nothing holds the first state here, so the information along these directions is zero.
  // First-estimate derivatives keep it zero although the estimates move after each marginalisation.
  SyntheticWorld world(SyntheticMotion{}, 4);
  VioConfig config = gaussian_config();
  config.calibrate = false;
  Window window = run_smoother(world.frames(kStartImages), world, 0.0, config).smoother.window();
  window.prior = {};
  std::mt19937 rng(4);
  for (int k = 0; k < 4; ++k) {
    for (WindowFrame& frame : window.frames) frame.keyframe = true;
    marginalize_oldest(window);
    for (WindowFrame& frame : window.frames) {
      frame.state.T_odom_body = retract(frame.state.T_odom_body, 0.02 * random_vector<6>(rng));
      frame.state.v_odom += 0.02 * random_vector<3>(rng);
    }
    WindowEquations equations(window, 0.0);
    equations.add_all();
    const Eigen::MatrixXd H = equations.H().selfadjointView<Eigen::Lower>();
    const Eigen::MatrixXd N = unobservable_directions(window);
    const Eigen::VectorXd information = (N.transpose() * H * N).diagonal();
    // Relative to the information of a single state, to allow for cancellation.
    const double known = H.topLeftCorner<6, 6>().trace();
    for (const double value : information) CHECK(std::abs(value) < 1e-8 * known);
  }
}

// Adds white noise of the densities that the smoother assumes. An image's first sample is the last
// of the image before.
void add_inertial_noise(std::vector<InertialFrame>& frames, const VioConfig& config,
                        std::mt19937& rng) {
  const ImuNoise noise = synthetic_rig().imu;
  const double per_sample = std::sqrt(noise.rate_hz);
  for (std::size_t k = 1; k < frames.size(); ++k)
    for (ImuSample& sample : frames[k].samples) {
      if (k > 1 && sample.stamp == frames[k - 1].samples.back().stamp) {
        sample = frames[k - 1].samples.back();
        continue;
      }
      sample.gyro +=
          per_sample * config.gyro_noise_factor * noise.gyro_noise_density * random_vector<3>(rng);
      sample.accel += per_sample * config.accel_noise_factor * noise.accel_noise_density *
                      random_vector<3>(rng);
    }
}

struct ModelledRun {
  SyntheticMotion motion;
  FixedLagSmoother smoother;
};

// Noise in images and samples, and errors of the guessed biases, all as modelled.
ModelledRun run_as_modelled(unsigned seed, const VioConfig& config, std::size_t landmarks = 40) {
  constexpr double kGyroBiasSigma = 0.02;  // around the guess of a start
  std::mt19937 rng(seed + 300);
  SyntheticMotion motion;
  motion.gyro_bias = kGyroBiasSigma * random_vector<3>(rng);
  motion.accel_bias = config.accel_bias_sigma * random_vector<3>(rng);
  SyntheticWorld world(motion, seed + 200, landmarks);
  std::vector<InertialFrame> frames = world.frames(50, 0.5);
  add_inertial_noise(frames, config, rng);
  std::vector<OdometryState> guess = world.states(kStartImages);
  for (OdometryState& state : guess) state.gyro_bias = state.accel_bias = {0.0, 0.0, 0.0};
  ModelledRun run{motion, FixedLagSmoother(synthetic_rig(), motion_model(synthetic_rig(), config))};
  REQUIRE(run.smoother.start(std::span(frames).first(kStartImages), guess));
  for (std::size_t k = kStartImages; k < frames.size(); ++k) (void)run.smoother.add(frames[k]);
  return run;
}

TEST_CASE("The errors of relative poses agree with their covariance") {
  // Mean of chi-squared with 6 degrees of freedom over the runs: 6 with this standard deviation.
  constexpr int kRuns = 60;
  const double sigma = std::sqrt(12.0 / kRuns);
  VioConfig config = gaussian_config();
  config.calibrate =
      false;  // The calibration is exact; its prior would make the covariance larger.
  double sum = 0.0, ratio = 0.0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const ModelledRun run = run_as_modelled(seed, config);
    const auto& frames = run.smoother.window().frames;
    const Stamp from = frames.front().state.stamp, to = frames.back().state.stamp;
    const auto relative = run.smoother.relative_pose(from, to);
    REQUIRE(relative);
    const SE3 truth =
        run.motion.state(from).T_odom_body.inverse() * run.motion.state(to).T_odom_body;
    const Vector6 e = se3_log(relative->T.inverse() * truth);
    sum += e.dot(relative->Sigma.ldlt().solve(e)) / kRuns;
    ratio += relative->error_ratio / kRuns;
  }
  CAPTURE(sum);
  CHECK(ratio == Approx(1.0).margin(0.1));
  CHECK(std::abs(sum - 6.0) < 3 * sigma);
}

TEST_CASE("Image points twice as noisy as assumed multiply the error ratio by four") {
  constexpr int kRuns = 20;
  VioConfig config = gaussian_config();
  config.calibrate = false;
  config.noise_px *= 0.5;
  double ratio = 0.0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const ModelledRun run = run_as_modelled(seed, config);
    const auto& frames = run.smoother.window().frames;
    const auto relative =
        run.smoother.relative_pose(frames.front().state.stamp, frames.back().state.stamp);
    REQUIRE(relative);
    ratio += relative->error_ratio / kRuns;
  }
  CHECK(ratio == Approx(4.0).epsilon(0.15));
}

TEST_CASE("Too few landmarks to measure the errors never make a covariance smaller") {
  const auto landmarks = static_cast<std::size_t>(GENERATE(range(4, 24)));
  CAPTURE(landmarks);
  const ModelledRun run = run_as_modelled(1, gaussian_config(), landmarks);
  const auto& frames = run.smoother.window().frames;
  const auto relative =
      run.smoother.relative_pose(frames.front().state.stamp, frames.back().state.stamp);
  REQUIRE(relative);
  CHECK(relative->error_ratio >= 1.0);
  CHECK(relative->error_ratio < 10.0);
}

TEST_CASE("A gyroscope that is noisier than assumed has less weight") {
  const auto scale_with = [](double factor) {
    const VioConfig config = gaussian_config();
    VioConfig noisy = config;
    noisy.gyro_noise_factor *= factor;
    std::mt19937 rng(5);
    SyntheticWorld world({}, 6, 40);
    std::vector<InertialFrame> frames = world.frames(100, 0.5);
    add_inertial_noise(frames, noisy, rng);
    FixedLagSmoother smoother(synthetic_rig(), motion_model(synthetic_rig(), config));
    REQUIRE(smoother.start(std::span(frames).first(kStartImages), world.states(kStartImages)));
    for (std::size_t k = kStartImages; k < frames.size(); ++k) (void)smoother.add(frames[k]);
    return smoother.gyro_noise_scale();
  };
  CHECK(scale_with(1.0) == 1.0);
  const double tenfold = scale_with(10.0);
  CHECK(tenfold > 2.0);
  CHECK(tenfold <= GyroNoiseScale::kMaxScale);
}

TEST_CASE("A start from a state with its covariance keeps that covariance") {
  SyntheticMotion motion;
  motion.gyro_bias = {0.005, -0.01, 0.01};
  SyntheticWorld world(motion, 10, 40);
  const auto frames = world.frames(90, 0.5);
  constexpr std::size_t kLast = 49;
  const Run before =
      run_smoother({frames.begin(), frames.begin() + kLast + 1}, world, 0.005, gaussian_config());
  const OdometryState& last = before.states.back();
  const auto known = before.smoother.state_covariance(last.stamp);
  REQUIRE(known);
  FixedLagSmoother smoother(synthetic_rig(), motion_model(synthetic_rig(), gaussian_config()));
  smoother.start(frames[kLast], last, *known);
  const auto kept = smoother.state_covariance(last.stamp);
  REQUIRE(kept);
  const Eigen::Matrix<double, 11, 1> scale = known->diagonal().cwiseSqrt().cwiseInverse();
  CHECK((scale.asDiagonal() * (*kept - *known) * scale.asDiagonal()).norm() < 1e-6);
  // All images from the next one on have poses, and the biases stay known.
  for (std::size_t k = kLast + 1; k < frames.size(); ++k) {
    const SmootherUpdate update = smoother.add(frames[k]);
    REQUIRE(update.solution.usable);
    CHECK(position_error(update.state, world) < 0.05);
    CHECK((update.state.gyro_bias - motion.gyro_bias).norm() < 3e-3);
  }
}

TEST_CASE("No small step lowers the cost of an optimised window with a prior") {
  const unsigned seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  SyntheticWorld world(SyntheticMotion{}, seed + 20);
  VioConfig config = gaussian_config();
  config.loss_scale = 1.5;
  config.calibrate = false;
  Window window = run_smoother(world.frames(60, 0.5), world, 0.01, config).smoother.window();
  REQUIRE_FALSE(window.prior.frames.empty());
  std::mt19937 rng(seed);
  for (WindowFrame& frame : window.frames)
    frame.state.T_odom_body = retract(frame.state.T_odom_body, 1e-3 * random_vector<6>(rng));
  const WindowSolution solution = optimize(window, 50);
  REQUIRE(solution.usable);
  CHECK(solution.final_cost < 0.9 * solution.initial_cost);
  for (int trial = 0; trial < 50; ++trial) {
    Window moved = window;
    for (WindowFrame& frame : moved.frames) {
      frame.state.T_odom_body = retract(frame.state.T_odom_body, 1e-5 * random_vector<6>(rng));
      frame.state.v_odom += 1e-5 * random_vector<3>(rng);
    }
    for (WindowLandmark& landmark : moved.landmarks)
      if (landmark.located) landmark.p_odom += 1e-5 * random_vector<3>(rng);
    CHECK(optimize(moved, 0).initial_cost > solution.final_cost);
  }
}

TEST_CASE("Wrong observations are dropped and do not increase the error") {
  SyntheticWorld world(SyntheticMotion{}, 6);
  auto frames = world.frames(60, 0.5);
  std::mt19937 rng(6);
  for (std::size_t k = kStartImages; k < frames.size(); ++k)
    for (std::size_t f = 0; f < frames[k].tracked.features.size(); f += 10)
      frames[k].tracked.features[f].left += 0.05 * random_vector<2>(rng);  // some 20 px
  VioConfig config = gaussian_config();
  config.loss_scale = 1.5;
  config.outlier_px = 3.0;
  const Run run = run_smoother(frames, world, 0.005, config);
  int dropped = 0;
  for (const SmootherUpdate& update : run.updates) dropped += update.outliers;
  CHECK(dropped > 50);
  CHECK(position_error(run.states.back(), world) < 0.01);
}

// From the 40th image on, all points are turned by 0.05 rad (23 px), and the gyroscope does not
// measure a turn. The smoother drops points that contradict its estimate.
TEST_CASE("Points that contradict the estimate are counted before they are dropped") {
  constexpr std::size_t kFirstWrong = 40;
  const bool is_wrong = GENERATE(false, true);
  SyntheticWorld world(SyntheticMotion{}, 9);
  auto frames = world.frames(60, 0.5);
  for (std::size_t k = kFirstWrong; is_wrong && k < frames.size(); ++k)
    for (TrackedFeature& feature : frames[k].tracked.features) {
      feature.left.x() += 0.05;
      if (feature.right) feature.right->x() += 0.05;
    }
  VioConfig config = gaussian_config();
  config.loss_scale = 1.5;
  config.outlier_px = 3.0;
  const Run run = run_smoother(frames, world, 0.005, config);
  EstimateWatch watch;
  std::size_t judged = 0;
  for (; judged < run.updates.size() && !watch.is_contradicted(); ++judged) {
    CHECK(run.updates[judged].fit.points > 40);
    watch.add(run.updates[judged].fit);
  }
  if (is_wrong) {
    CHECK(judged + kStartImages > kFirstWrong);
    CHECK(judged + kStartImages < kFirstWrong + 10);
  } else {
    CHECK(watch.evidence() == 0.0);
  }
}

TEST_CASE("During a long rest the window keeps its keyframes and does not grow") {
  SyntheticWorld world(SyntheticMotion::standing(), 12);
  constexpr std::size_t kRest = kStartImages + 20, kFilled = kRest + 5, kImages = kRest + 200;
  const auto frames = world.frames(kImages, 0.5);
  Run run = run_smoother({frames.begin(), frames.begin() + kRest}, world, 0.0, gaussian_config());
  const auto keyframes = [&] {
    std::vector<Stamp> stamps;
    for (const WindowFrame& frame : run.smoother.window().frames)
      if (frame.keyframe) stamps.push_back(frame.state.stamp);
    return stamps;
  };
  SmootherUpdate update = run.smoother.add(frames[kRest], true);
  CHECK(update.keyframe);  // the first at rest
  for (std::size_t k = kRest + 1; k < kFilled; ++k) update = run.smoother.add(frames[k], true);
  const std::vector<Stamp> before = keyframes();
  for (std::size_t k = kFilled; k < kImages; ++k) {
    update = run.smoother.add(frames[k], true);
    CHECK(update.solution.usable);
    CHECK_FALSE(update.keyframe);
    CHECK(position_error(update.state, world) < 5e-3);
  }
  CHECK(keyframes() == before);
  std::size_t samples = 0;
  for (std::size_t k = before.size(); k < run.smoother.window().frames.size(); ++k)
    samples += run.smoother.window().frames[k].samples.size();
  CHECK(run.smoother.window().frames.size() <= before.size() + 4);
  CHECK(samples <= std::size_t{4 * 13});  // samples in 50 ms at 200 Hz, with both borders
  // Ten seconds between two images of one rest.
  const auto T = run.smoother.relative_pose(frames[kRest].tracked.stamp, update.state.stamp);
  REQUIRE(T);
  CHECK(T->T.translation().norm() < 5e-3);
  // A centimetre is not noticed at rest.
  CHECK(T->Sigma.diagonal().maxCoeff() < 2e-4);
}

constexpr double kSigma_rad = 1e-3;

// After `seconds` of images, 20 a second, that differ by `sigmas` standard deviations per axis.
double scale_after(GyroNoiseScale& noise, double sigmas, double seconds) {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal(0.0, sigmas * kSigma_rad);
  for (int k = 0; k < static_cast<int>(20.0 * seconds); ++k) {
    const double x = normal(rng), y = normal(rng), z = normal(rng);
    noise.add(std::sqrt(x * x + y * y + z * z), 3.0 * kSigma_rad * kSigma_rad, 0.05);
  }
  return noise.scale();
}

TEST_CASE("The scale of the gyroscope's noise follows the images within bounds") {
  GyroNoiseScale noise;
  CHECK(noise.scale() == 1.0);
  CHECK(scale_after(noise, 0.5, 30.0) == 1.0);
  CHECK(scale_after(noise, 2.0, 30.0) == Approx(2.0).margin(0.4));
  CHECK(scale_after(noise, 100.0, 30.0) == Approx(GyroNoiseScale::kMaxScale).margin(1e-3));
  CHECK(scale_after(noise, 0.5, 30.0) == 1.0);
}

TEST_CASE("Neither a diverged estimate nor one image changes the noise of the gyroscope") {
  const double difference_rad = GENERATE(std::numeric_limits<double>::quiet_NaN(), 1.0);
  GyroNoiseScale noise;
  noise.add(difference_rad, 3.0 * kSigma_rad * kSigma_rad, 0.05);
  CHECK(noise.scale() == 1.0);
  CHECK(scale_after(noise, 2.0, 30.0) == Approx(2.0).margin(0.4));
}

}  // namespace
}  // namespace km
