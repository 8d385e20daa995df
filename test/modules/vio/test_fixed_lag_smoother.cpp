#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <memory>
#include <optional>
#include <vector>

// glog, which comes with Ceres, has its own CHECK, which ends the program.
#pragma push_macro("CHECK")
#undef CHECK
#include <ceres/ceres.h>
#pragma pop_macro("CHECK")

#include "modules/core/lie.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/window_optimizer.hpp"
#include "synthetic_motion.hpp"

namespace km {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A frame of the window as 15 parameters: local coordinates of its pose about the first one, then
// velocity, gyro bias and accelerometer bias.
struct Chart {
  OdometryState origin;
  FirstEstimate held;

  [[nodiscard]] Vector15 parameters() const {
    Vector15 x;
    x << Vector6::Zero(), origin.v_odom, origin.gyro_bias, origin.accel_bias;
    return x;
  }
  [[nodiscard]] OdometryState state(const double* x) const {
    OdometryState state = origin;
    state.T_odom_body = retract(origin.T_odom_body, Eigen::Map<const Vector6>(x));
    state.v_odom = Eigen::Map<const Eigen::Vector3d>(x + 6);
    state.gyro_bias = Eigen::Map<const Eigen::Vector3d>(x + 9);
    state.accel_bias = Eigen::Map<const Eigen::Vector3d>(x + 12);
    return state;
  }
  // Derivative of the step that retracts the state by the parameters.
  [[nodiscard]] Matrix15 step_by_parameters(const double* x) const {
    const Eigen::Vector3d phi = Eigen::Map<const Eigen::Vector3d>(x);
    Matrix15 D = Matrix15::Identity();
    D.block<3, 3>(0, 0) = so3_right_jacobian(phi);
    D.block<3, 3>(3, 3) = so3_exp(-phi);
    return D;
  }
  // Stores J, derivatives by the first columns of the step, as one by the parameters.
  void store(const Eigen::MatrixXd& J, const double* x, double* jacobian) const {
    if (jacobian != nullptr)
      Eigen::Map<RowMatrix>(jacobian, J.rows(), 15) = J * step_by_parameters(x).topRows(J.cols());
  }
};

// Blocks: frame, landmark.
class ReprojectionCost final : public ceres::SizedCostFunction<2, 15, 3> {
 public:
  ReprojectionCost(const ViewModel& view, const Eigen::Vector2d& bearing, const Chart& frame)
      : view_(view), bearing_(bearing), frame_(frame) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const SE3 T = frame_.state(x[0]).T_odom_body;
    ReprojectionTerm term;
    if (!linearize_reprojection(view_, bearing_, T, frame_.held.pose.value_or(T),
                                Eigen::Map<const Eigen::Vector3d>(x[1]), term))
      return false;
    Eigen::Map<Eigen::Vector2d>{residuals} = term.r;
    if (jacobians == nullptr) return true;
    frame_.store(term.J_pose, x[0], jacobians[0]);
    if (jacobians[1] != nullptr) Eigen::Map<RowMatrix>(jacobians[1], 2, 3) = term.J_point;
    return true;
  }

 private:
  const ViewModel& view_;
  Eigen::Vector2d bearing_;
  const Chart& frame_;
};

// Blocks: frames i and j.
class ImuCost final : public ceres::SizedCostFunction<15, 15, 15> {
 public:
  ImuCost(const ImuFactor& factor, const Chart& i, const Chart& j)
      : factor_(factor), i_(i), j_(j) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const OdometryState i = i_.state(x[0]), j = j_.state(x[1]);
    const ImuTerm term = factor_.linearize(i, j, i_.held.applied_to(i), j_.held.applied_to(j));
    Eigen::Map<Vector15>{residuals} = term.r;
    if (jacobians == nullptr) return true;
    i_.store(term.J_i, x[0], jacobians[0]);
    j_.store(term.J_j, x[1], jacobians[1]);
    return true;
  }

 private:
  const ImuFactor& factor_;
  const Chart& i_;
  const Chart& j_;
};

// Blocks: the frames of the prior. Its J is the derivative at every state: the first estimate.
class PriorCost final : public ceres::CostFunction {
 public:
  PriorCost(const StatePrior& prior, std::vector<const Chart*> frames)
      : prior_(prior), frames_(std::move(frames)) {
    set_num_residuals(static_cast<int>(prior.r.size()));
    mutable_parameter_block_sizes()->assign(frames_.size(), 15);
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    std::vector<OdometryState> states;
    for (std::size_t k = 0; k < frames_.size(); ++k) states.push_back(frames_[k]->state(x[k]));
    std::vector<const OdometryState*> pointers;
    for (const OdometryState& state : states) pointers.push_back(&state);
    Eigen::Map<Eigen::VectorXd>(residuals, prior_.r.size()) =
        prior_.J * prior_offset(prior_, pointers) + prior_.r;
    if (jacobians == nullptr) return true;
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      const Eigen::Index column = k == 0 ? 0 : 9 + 6 * static_cast<Eigen::Index>(k);
      frames_[k]->store(prior_.J.middleCols(column, k == 0 ? 15 : 6), x[k], jacobians[k]);
    }
    return true;
  }

 private:
  const StatePrior& prior_;
  std::vector<const Chart*> frames_;
};

// A window as parameter blocks. The costs refer to it and to the window.
class WindowProblem {
 public:
  explicit WindowProblem(const Window& window);

  void solve(const ceres::Solver::Options& options, ceres::Solver::Summary& summary) {
    ceres::Solve(options, &problem_, &summary);
  }
  [[nodiscard]] std::shared_ptr<ceres::ParameterBlockOrdering> ordering() {
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    for (Eigen::Vector3d& point : points_)  // eliminated first
      if (problem_.HasParameterBlock(point.data())) order->AddElementToGroup(point.data(), 0);
    for (Vector15& state : states_) order->AddElementToGroup(state.data(), 1);
    return order;
  }
  void write_to(Window& window) const {
    for (std::size_t k = 0; k < states_.size(); ++k)
      window.frames[k].state = charts_[k].state(states_[k].data());
    for (std::size_t l = 0; l < points_.size(); ++l) window.landmarks[l].p_odom = points_[l];
  }

 private:
  void add_landmarks(const Window& window);

  std::vector<Chart> charts_;
  std::vector<Vector15> states_;
  std::vector<Eigen::Vector3d> points_;
  ceres::Problem problem_;
};

WindowProblem::WindowProblem(const Window& window) {
  const std::vector<FirstEstimate> held = first_estimates(window);
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    charts_.push_back({window.frames[k].state, held[k]});
    states_.push_back(charts_.back().parameters());
  }
  for (std::size_t k = 0; k < window.frames.size(); ++k) {
    problem_.AddParameterBlock(states_[k].data(), 15);
    if (k > 0 && window.frames[k].imu)
      problem_.AddResidualBlock(new ImuCost(*window.frames[k].imu, charts_[k - 1], charts_[k]),
                                nullptr, states_[k - 1].data(), states_[k].data());
  }
  add_landmarks(window);
  if (window.prior.frames.empty()) return;
  std::vector<const Chart*> charts;
  std::vector<double*> blocks;
  for (const std::uint64_t id : window.prior.frames) {
    const std::size_t k = frame_index(window, id);
    charts.push_back(&charts_[k]);
    blocks.push_back(states_[k].data());
  }
  problem_.AddResidualBlock(new PriorCost(window.prior, charts), nullptr, blocks);
}

void WindowProblem::add_landmarks(const Window& window) {
  for (const WindowLandmark& landmark : window.landmarks) points_.push_back(landmark.p_odom);
  for (std::size_t l = 0; l < points_.size(); ++l) {
    const WindowLandmark& landmark = window.landmarks[l];
    if (!landmark.located || landmark.observations.size() < 2) continue;
    for (const WindowObservation& o : landmark.observations)
      for (std::size_t c = 0; c < 2; ++c)
        if (o.bearings[c])
          problem_.AddResidualBlock(
              new ReprojectionCost(window.views[c], *o.bearings[c], charts_[o.frame]),
              new ceres::CauchyLoss(window.loss_scale), states_[o.frame].data(), points_[l].data());
  }
}

// An independent optimize(): minimises the same cost by trust-region steps of Ceres with the
// landmarks eliminated (DENSE_SCHUR). If Ceres fails, the solution is not usable and the window is
// unchanged.
WindowSolution optimize_by_ceres(Window& window, int max_iterations) {
  WindowProblem problem(window);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = problem.ordering();
  options.max_num_iterations = max_iterations;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  problem.solve(options, summary);
  const bool usable = summary.IsSolutionUsable();
  if (usable) problem.write_to(window);
  return {static_cast<int>(summary.iterations.size()) - 1, summary.initial_cost, summary.final_cost,
          usable};
}

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

TEST_CASE("The motion at constant velocity is estimated exactly from exact data", "[vio]") {
  const auto motion = SyntheticMotion::straight({0.5, 0.0, 0.0});
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

TEST_CASE("Biases and a varied motion are estimated from exact data", "[vio]") {
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
TEST_CASE("A landmark without distance ties the rotations of images, and is no fault", "[vio]") {
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

TEST_CASE("Marginalisation gives no information on heading and position", "[vio]") {
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
  OdometryState last;
};

// Noise in images and samples, and errors of the guessed biases, all as modelled.
ModelledRun run_as_modelled(unsigned seed, const VioConfig& config) {
  constexpr double kGyroBiasSigma = 0.02;  // around the guess of a start
  std::mt19937 rng(seed + 300);
  SyntheticMotion motion;
  motion.gyro_bias = kGyroBiasSigma * random_vector<3>(rng);
  motion.accel_bias = config.accel_bias_sigma * random_vector<3>(rng);
  SyntheticWorld world(motion, seed + 200, 40);
  std::vector<InertialFrame> frames = world.frames(50, 0.5);
  add_inertial_noise(frames, config, rng);
  std::vector<OdometryState> guess = world.states(kStartImages);
  for (OdometryState& state : guess) state.gyro_bias = state.accel_bias = {0.0, 0.0, 0.0};
  ModelledRun run{motion, FixedLagSmoother(synthetic_rig(), config), {}};
  REQUIRE(run.smoother.start(std::span(frames).first(kStartImages), guess));
  for (std::size_t k = kStartImages; k < frames.size(); ++k)
    run.last = run.smoother.add(frames[k]).state;
  return run;
}

TEST_CASE("The errors of relative poses agree with their covariance", "[vio]") {
  // Mean of chi-squared with 6 degrees of freedom over the runs: 6 with this standard deviation.
  constexpr int kRuns = 60;
  const double sigma = std::sqrt(12.0 / kRuns);
  VioConfig config = gaussian_config();
  config.calibrate =
      false;  // The calibration is exact; its prior would make the covariance larger.
  double sum = 0.0;
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
  }
  CAPTURE(sum);
  CHECK(std::abs(sum - 6.0) < 3 * sigma);
}

// Components of a StateCovariance, for the difference from `estimate` to `truth`.
Eigen::Matrix<double, 11, 1> difference(const OdometryState& estimate, const OdometryState& truth) {
  const Eigen::Vector3d turn =
      so3_log(truth.T_odom_body.linear() * estimate.T_odom_body.linear().transpose());
  Eigen::Matrix<double, 11, 1> e;
  e << turn.head<2>(),
      truth.v_odom - estimate.v_odom - turn.z() * Eigen::Vector3d::UnitZ().cross(estimate.v_odom),
      truth.gyro_bias - estimate.gyro_bias, truth.accel_bias - estimate.accel_bias;
  return e;
}

TEST_CASE("A gyroscope that is noisier than assumed has less weight", "[vio]") {
  const auto scale_with = [](double factor) {
    const VioConfig config = gaussian_config();
    VioConfig noisy = config;
    noisy.gyro_noise_factor *= factor;
    std::mt19937 rng(5);
    SyntheticWorld world({}, 6, 40);
    std::vector<InertialFrame> frames = world.frames(100, 0.5);
    add_inertial_noise(frames, noisy, rng);
    FixedLagSmoother smoother(synthetic_rig(), config);
    REQUIRE(smoother.start(std::span(frames).first(kStartImages), world.states(kStartImages)));
    for (std::size_t k = kStartImages; k < frames.size(); ++k) (void)smoother.add(frames[k]);
    return smoother.gyro_noise_scale();
  };
  CHECK(scale_with(1.0) == 1.0);
  const double tenfold = scale_with(10.0);
  CHECK(tenfold > 2.0);
  CHECK(tenfold <= GyroNoiseScale::kMaxScale);
}

TEST_CASE("The errors of states agree with their covariance", "[vio]") {
  // Mean of chi-squared with 11 degrees of freedom over 20 runs: 11 with a standard deviation of
  // 1.05.
  double sum = 0.0;
  constexpr int kRuns = 20;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const ModelledRun run = run_as_modelled(seed, gaussian_config());
    const auto covariance = run.smoother.state_covariance(run.last.stamp);
    REQUIRE(covariance);
    CHECK(is_usable(*covariance));
    const auto e = difference(run.last, run.motion.state(run.last.stamp));
    sum += e.dot(covariance->ldlt().solve(e)) / kRuns;
  }
  CAPTURE(sum);
  CHECK(std::abs(sum - 11.0) < 3 * 1.05);
}

TEST_CASE("A start from a state with its covariance keeps that covariance", "[vio]") {
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
  FixedLagSmoother smoother(synthetic_rig(), gaussian_config());
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

TEST_CASE("Ceres reaches the same minimum of a window with a prior", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  SyntheticWorld world(SyntheticMotion{}, seed + 20);
  VioConfig config = gaussian_config();
  config.loss_scale = 1.5;
  config.calibrate = false;
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

TEST_CASE("Wrong observations are dropped and do not increase the error", "[vio]") {
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
TEST_CASE("Points that contradict the estimate are counted before they are dropped",
          "[vio][contradiction]") {
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
    CHECK(watch.variance_factor() > 2.0);
  } else {
    CHECK(watch.evidence() == 0.0);
    CHECK(watch.variance_factor() < 1.1);
  }
}

TEST_CASE("A second without features is bridged by the inertial samples", "[vio]") {
  SyntheticWorld world(SyntheticMotion{}, 7);
  auto frames = world.frames(80, 0.5);
  for (std::size_t k = 30; k < 50; ++k) frames[k].tracked.features.clear();
  for (std::size_t k = 50; k < frames.size(); ++k)  // the tracker sees new features afterwards
    for (TrackedFeature& feature : frames[k].tracked.features) feature.id += 1000;
  VioConfig config = gaussian_config();
  config.calibrate = false;  // seven more unknowns are not well known after 1.5 s
  const Run run = run_smoother(frames, world, 0.005, config);
  for (const SmootherUpdate& update : run.updates) CHECK(update.solution.usable);
  CHECK(position_error(run.states[49], world) < 0.05);
  CHECK(position_error(run.states.back(), world) < 0.05);
}

TEST_CASE("During a long rest the window keeps its keyframes and does not grow", "[vio][rest]") {
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

TEST_CASE("An image that samples do not cover leaves no usable solution", "[vio]") {
  SyntheticWorld world(SyntheticMotion{}, 9);
  auto frames = world.frames(kStartImages + 1);
  Run run = run_smoother({frames.begin(), frames.end() - 1}, world, 0.0, gaussian_config());
  frames.back().samples.pop_back();
  CHECK_FALSE(run.smoother.add(frames.back()).solution.usable);
}

TEST_CASE("The smoother refuses a configuration out of bounds", "[vio]") {
  VioConfig config;
  config.window_keyframes = 1;
  CHECK_THROWS_AS(FixedLagSmoother(synthetic_rig(), config), ConfigError);
}

}  // namespace
}  // namespace km
