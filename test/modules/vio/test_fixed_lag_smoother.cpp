#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/window_equations.hpp"
#include "modules/vio/window_sliding.hpp"
#include "synthetic_motion.hpp"
#include "window_optimizer_ceres.hpp"

namespace km {
namespace {

constexpr int kStartImages = 15;

struct Run {
  FixedLagSmoother smoother;
  std::vector<OdometryState> states;
  std::vector<SmootherUpdate> updates;
};

VioConfig gaussian_config() {
  VioConfig config;
  config.noise_px = 0.5;
  config.loss_scale = 1e3;
  config.outlier_px = 10.0;
  config.gravity_mps2 = kGravity_mps2;
  return config;
}

// Smooths `frames` from a guess that is off by `guess_error`.
Run run_smoother(const std::vector<InertialFrame>& frames, const SyntheticWorld& world,
                 double guess_error, const VioConfig& config) {
  Run run{FixedLagSmoother(synthetic_rig(), config), {}, {}};
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

TEST_CASE("Exact data of a constant velocity are recovered exactly", "[vio]") {
  SyntheticMotion motion;
  motion.amplitude_m.setZero();
  motion.turn_amplitude.setZero();
  motion.velocity = {0.5, 0.0, 0.0};
  SyntheticWorld world(motion, 1);
  const auto frames = world.frames(60);
  const Run run = run_smoother(frames, world, 0.01, gaussian_config());
  for (const OdometryState& state : run.states) {
    CHECK(position_error(state, world) < 1e-6);
    CHECK((state.v_odom - motion.velocity).norm() < 1e-6);
    CHECK(state.gyro_bias.norm() < 1e-7);
    CHECK(state.accel_bias.norm() < 1e-5);
  }
}

TEST_CASE("Biases and a lively motion are recovered from exact data", "[vio]") {
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

TEST_CASE("The window stays bounded and its prior covers keyframes only", "[vio]") {
  SyntheticWorld world(SyntheticMotion{}, 3);
  const VioConfig config = gaussian_config();
  const Run run = run_smoother(world.frames(120, 0.5), world, 0.01, config);
  const Window& window = run.smoother.window();
  CHECK(window.frames.size() <=
        static_cast<std::size_t>(config.window_keyframes + config.window_recent + 2));
  REQUIRE_FALSE(window.prior.frames.empty());
  CHECK(window.prior.frames.front() == window.frames.front().id);
  for (const std::uint64_t id : window.prior.frames)
    CHECK(window.frames.at(frame_index(window, id)).keyframe);
}

// How everything turns about the vertical, and shifts, seen from each state: no measurement
// changes.
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

TEST_CASE("Marginalisation gives no information on heading and position", "[vio]") {
  // Nothing holds the first state here, so the information along these directions is zero, and
  // first-estimate derivatives keep it so although the estimates move after each marginalisation.
  SyntheticWorld world(SyntheticMotion{}, 4);
  Window window =
      run_smoother(world.frames(kStartImages), world, 0.0, gaussian_config()).smoother.window();
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
    // Against what a single state has: rounding of numbers that cancel.
    const double known = H.topLeftCorner<6, 6>().trace();
    for (const double value : information) CHECK(std::abs(value) < 1e-8 * known);
  }
}

TEST_CASE("Relative poses err as their covariance says", "[vio]") {
  // 20 runs of a motion with image noise; the inertial samples are exact, so that errors may be
  // somewhat smaller than modelled. Mean of chi-squared with 6 degrees of freedom over 20 runs: 6
  // with a standard deviation of 0.77.
  double sum = 0.0;
  constexpr int kRuns = 20;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    SyntheticWorld world(SyntheticMotion{}, seed + 100, 40);
    const Run run = run_smoother(world.frames(50, 0.5), world, 0.005, gaussian_config());
    const auto& frames = run.smoother.window().frames;
    const Stamp from = frames.front().state.stamp, to = frames.back().state.stamp;
    const auto relative = run.smoother.relative_pose(from, to);
    REQUIRE(relative);
    const SE3 truth =
        world.motion().state(from).T_odom_body.inverse() * world.motion().state(to).T_odom_body;
    const Vector6 e = se3_log(relative->T.inverse() * truth);
    sum += e.dot(relative->Sigma.ldlt().solve(e)) / kRuns;
  }
  CHECK(sum > 2.5);
  CHECK(sum < 6.0 + 3 * 0.77);
}

TEST_CASE("Ceres reaches the same minimum of a window with a prior", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  SyntheticWorld world(SyntheticMotion{}, seed + 20);
  VioConfig config = gaussian_config();
  config.loss_scale = 1.5;
  Window by_schur = run_smoother(world.frames(60, 0.5), world, 0.01, config).smoother.window();
  REQUIRE_FALSE(by_schur.prior.frames.empty());
  std::mt19937 rng(seed);
  for (WindowFrame& frame : by_schur.frames)
    frame.state.T_odom_body = retract(frame.state.T_odom_body, 1e-3 * random_vector<6>(rng));
  Window by_ceres = by_schur;
  const WindowSolution schur = optimize(by_schur, 50), ceres = optimize_by_ceres(by_ceres, 100);
  REQUIRE(schur.usable);
  REQUIRE(ceres.usable);
  CHECK(schur.initial_cost == Approx(ceres.initial_cost).epsilon(1e-9));
  CHECK(schur.final_cost < 0.9 * schur.initial_cost);
  CHECK(schur.final_cost == Approx(ceres.final_cost).epsilon(1e-5));
  for (std::size_t k = 0; k < by_schur.frames.size(); ++k)
    CHECK(local_coordinates(by_schur.frames[k].state.T_odom_body,
                            by_ceres.frames[k].state.T_odom_body)
              .norm() < 1e-4);
}

TEST_CASE("Wrong observations are dropped and do no harm", "[vio]") {
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

TEST_CASE("A second without features is bridged by the inertial samples", "[vio]") {
  SyntheticWorld world(SyntheticMotion{}, 7);
  auto frames = world.frames(80, 0.5);
  for (std::size_t k = 30; k < 50; ++k) frames[k].tracked.features.clear();
  for (std::size_t k = 50; k < frames.size(); ++k)  // the tracker sees new features afterwards
    for (TrackedFeature& feature : frames[k].tracked.features) feature.id += 1000;
  const Run run = run_smoother(frames, world, 0.005, gaussian_config());
  for (const SmootherUpdate& update : run.updates) CHECK(update.solution.usable);
  CHECK(position_error(run.states[49], world) < 0.05);
  CHECK(position_error(run.states.back(), world) < 0.05);
}

TEST_CASE("The same input gives the same output to the last bit", "[vio]") {
  const VioConfig config = gaussian_config();
  SyntheticWorld world(SyntheticMotion{}, 8);
  const auto frames = world.frames(40, 0.5);
  const Run a = run_smoother(frames, world, 0.005, config);
  const Run b = run_smoother(frames, world, 0.005, config);
  for (std::size_t k = 0; k < a.states.size(); ++k)
    CHECK(a.states[k].T_odom_body.matrix() == b.states[k].T_odom_body.matrix());
}

TEST_CASE("Samples that do not cover an image are refused by name", "[vio]") {
  SyntheticWorld world(SyntheticMotion{}, 9);
  auto frames = world.frames(kStartImages + 1);
  Run run = run_smoother({frames.begin(), frames.end() - 1}, world, 0.0, gaussian_config());
  frames.back().samples.pop_back();
  CHECK_THROWS_WITH(run.smoother.add(frames.back()), Catch::Matchers::Contains("do not cover"));
}

TEST_CASE("The smoother refuses a configuration out of bounds", "[vio]") {
  VioConfig config;
  config.window_keyframes = 1;
  CHECK_THROWS_AS(FixedLagSmoother(synthetic_rig(), config), ConfigError);
}

}  // namespace
}  // namespace km
