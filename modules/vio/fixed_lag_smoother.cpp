#include "modules/vio/fixed_lag_smoother.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <iterator>
#include <utility>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

constexpr int kStartIterations = 30;
constexpr int kIterations = 3;            // largest number of optimisation steps per image
constexpr std::size_t kRecentImages = 3;  // most recent images in the window
// A keyframe is made when the image has moved this far, rotation removed. It is also made when at
// most this share of the features of the last keyframe is still tracked, or this time has passed.
constexpr double kKeyframeParallax_px = 12.0;
constexpr double kKeyframeTrackedShare = 0.6;
constexpr double kKeyframeInterval_s = 1.0;
constexpr int kMinKeyframeFeatures = 20;   // least number of features in a keyframe
constexpr double kStartKeyframe_s = 0.15;  // spacing of keyframes in the images of the start
// Keyframes locate new landmarks. If no feature of an image has a depth, the criteria for a
// keyframe have this factor, so that an image with depths is likely to become the keyframe.
constexpr double kPatience = 2.0;

// True if any landmark in the last frame has a right observation.
bool locates_new(const Window& window) {
  return std::any_of(window.landmarks.begin(), window.landmarks.end(), [&](const auto& landmark) {
    return tracked_now(window, landmark) && landmark.observations.back().bearings[1];
  });
}

// Samples of both lists that cover [from, to] as far as available; those of `former` come first.
std::vector<ImuSample> joined(std::span<const ImuSample> former, std::span<const ImuSample> later,
                              Stamp from, Stamp to) {
  std::vector<ImuSample> samples;
  const auto take = [&](const ImuSample& sample) {
    if (!samples.empty() && (sample.stamp <= samples.back().stamp || samples.back().stamp >= to))
      return;
    if (sample.stamp <= from) samples.clear();
    samples.push_back(sample);
  };
  std::ranges::for_each(former, take);
  std::ranges::for_each(later, take);
  return samples;
}

// Angular rate at an instant: the last gyroscope sample not after it.
Eigen::Vector3d gyro_at(std::span<const ImuSample> samples, Stamp instant) {
  const auto after = std::ranges::upper_bound(samples, instant, {}, &ImuSample::stamp);
  return after == samples.begin() ? samples.front().gyro : std::prev(after)->gyro;
}

// Standard deviations of the correction to the mounting at the start, each axis.
constexpr double kMountingRotation_rad = 0.01;
constexpr double kMountingTranslation_m = 0.003;

// Largest plausible distance of the calibration from the rig's values [standard deviations].
constexpr double kMostCalibration = 10.0;

// Bounds on the estimated offset between images and inertial samples, so that the instants of
// images stay in order.
constexpr double kMostOffset_s = 0.1;
constexpr double kMostOffsetStep = 0.25;  // largest change, as a fraction of the image interval

// Standard deviation of the first position, which fixes the gauge.
constexpr double kHeldPosition_m = 1e-3;
constexpr double kHeldHeading_rad = 1e-3;
// Noise of samples interpolated over a gap, so large (0.35 rad and 1.4 m/s after 0.5 s) that the
// images determine the motion.
constexpr double kBridgeGyro = 0.5;   // [rad/s/sqrt(Hz)]
constexpr double kBridgeAccel = 2.0;  // [m/s^2/sqrt(Hz)]

// Rows of a prior that hold heading and position of a state. The heading is the rotation about the
// vertical, expressed in the body frame.
Eigen::MatrixXd held_gauge(const OdometryState& state) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(4, 15);
  J.block<1, 3>(0, 0) = state.T_odom_body.linear().row(2) / kHeldHeading_rad;
  J.block<3, 3>(1, 3).diagonal().setConstant(1.0 / kHeldPosition_m);
  return J;
}

// Maps an error in the 15 variables of a state to the variables of StateCovariance, which do not
// include heading and position. The change of the velocity due to the heading is removed.
Eigen::Matrix<double, 11, 15> without_gauge(const OdometryState& state) {
  const Eigen::Matrix3d R = state.T_odom_body.linear();
  Eigen::Matrix<double, 11, 15> J = Eigen::Matrix<double, 11, 15>::Zero();
  J.topLeftCorner<2, 3>() = R.topRows<2>();
  J.block<3, 3>(2, 0) = -Eigen::Vector3d::UnitZ().cross(state.v_odom) * R.row(2);
  J.bottomRightCorner<9, 9>().setIdentity();
  return J;
}

}  // namespace

FixedLagSmoother::FixedLagSmoother(const SensorRig& rig, const MotionModel& model,
                                   const LearnedSensors& learned)
    : model_(model),
      noise_(rig.imu),
      gyro_noise_(learned.gyro_noise),
      shown_motion_(learned.shown_motion) {
  noise_.gyro_noise_density *= model_.config.gyro_noise_factor;
  noise_.accel_noise_density *= model_.config.accel_noise_factor;
  for (std::size_t c = 0; c < 2; ++c)
    window_.rig_views[c] = view_model(rig.stereo.cameras[c], model_.config.noise_px);
  window_.calibrates = model_.config.calibrate;
  calibrate(window_, {});
  calibration_covariance_ = calibration_prior();
  if (window_.calibrates && learned.calibration) take_calibration(*learned.calibration);
  window_.gravity_mps2 = model_.config.gravity_mps2;
  window_.loss_scale = model_.config.loss_scale;
  focal_px_ = window_.views[0].weight * model_.config.noise_px;
  R_cam_body_ = window_.views[0].R_cam_body;
  T_body_left_ = rig.stereo.cameras[0].T_body_cam;
}

std::optional<std::vector<OdometryState>> FixedLagSmoother::start(
    std::span<const InertialFrame> frames, std::span<const OdometryState> guess) {
  Stamp last_keyframe = 0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (!append(frames[k], guess[k], 0.0)) return std::nullopt;
    observe(window_, frames[k].tracked);
    const Stamp stamp = frames[k].tracked.stamp;
    if (k > 0 && k + 1 < frames.size() && seconds_between(last_keyframe, stamp) < kStartKeyframe_s)
      continue;
    window_.frames.back().keyframe = true;
    last_keyframe = stamp;
  }
  set_first_prior();
  for (int pass = 0; pass < 2; ++pass) {
    locate_landmarks();
    if (!optimize(window_, kStartIterations).usable) return std::nullopt;
    reject_outliers();
  }
  // The prior of set_first_prior() is not set again. It holds the biases near their guess, and the
  // optimisation has not moved position and heading of the first frame.
  std::vector<OdometryState> states;
  for (const WindowFrame& frame : window_.frames) states.push_back(frame.state);
  return states;
}

void FixedLagSmoother::start(const InertialFrame& frame, const OdometryState& state,
                             const StateCovariance& covariance) {
  (void)append(frame, state, first_offset_s(frame));  // true: the first frame has no factor
  observe(window_, frame.tracked);
  window_.frames.back().keyframe = true;
  window_.frames.back().samples = frame.samples;
  StatePrior& prior = window_.prior;
  prior.frames = {window_.frames.back().id};
  prior.linearization = {window_.frames.back().state};
  prior.J.resize(15, 15);
  prior.J << held_gauge(state), covariance.llt().matrixL().solve(without_gauge(state));
  hold_calibration();
}

// Begins with a calibration of before if that is plausible.
void FixedLagSmoother::take_calibration(const UncertainCalibration& known) {
  const CalibrationVector moved = CameraCalibration{}.local_coordinates_to(known.calibration);
  if (known.covariance.llt().info() != Eigen::Success ||
      !(moved.dot(calibration_covariance_.llt().solve(moved)) <
        kMostCalibration * kMostCalibration))
    return;
  calibrate(window_, known.calibration);
  calibration_covariance_ = known.covariance;
}

SmootherUpdate FixedLagSmoother::add(const InertialFrame& frame, bool rests) {
  SmootherUpdate update;
  if (!slide(rests) || !append(frame, window_.frames.back().state, next_offset_s(frame)))
    return update;
  WindowFrame& newest = window_.frames.back();
  const OdometryState predicted = predict(window_.frames[window_.frames.size() - 2].state,
                                          newest.imu->imu(), model_.config.gravity_mps2);
  const bool is_moved = !model_.is_measured && frame.tracked.T_previous_current;
  newest.state = is_moved ? moved_by_images(window_.frames[window_.frames.size() - 2].state,
                                            frame.tracked, T_body_left_)
                          : predicted;
  newest.state.stamp = frame.tracked.stamp;
  newest.rests = rests;
  observe(window_, frame.tracked);
  decide_keyframe();
  locate_landmarks();
  update.solution = optimize(window_, kIterations);
  update.fit = fit_of_newest();
  update.outliers = reject_outliers();
  if (model_.is_measured && !newest.imu->rests() && !newest.is_bridged) compare_gyro();
  if (is_moved)
    shown_motion_.add(
        window_.frames[last_keyframe()].state, newest.state,
        seconds_between(window_.frames[window_.frames.size() - 2].state.stamp, newest.state.stamp));
  update.state = newest.state;
  update.keyframe = newest.keyframe;
  for (const WindowLandmark& landmark : window_.landmarks) {
    if (!landmark.located) continue;
    ++update.landmarks;
    update.seen += tracked_now(window_, landmark);
  }
  return update;
}

bool FixedLagSmoother::append(const InertialFrame& frame, OdometryState state, double offset_s) {
  WindowFrame& added = window_.frames.emplace_back();
  added.id = next_id_++;
  added.state = std::move(state);
  added.state.stamp = frame.tracked.stamp;
  added.offset_s = offset_s;
  const std::size_t now = window_.frames.size() - 1;
  if (now == 0) return true;
  added.samples = frame.samples;
  added.is_bridged = frame.is_bridged;
  added.is_smooth = !model_.is_measured && !frame.tracked.T_previous_current;
  // The prior determines the velocity after the last image before the loss of vision, too.
  WindowFrame& before = window_.frames[now - 1];
  if (added.is_smooth && before.imu && !before.imu->rests()) {
    before.is_smooth = true;
    if (!set_imu(now - 1)) return false;
  }
  return window_.calibrates ? share_samples() && set_imu(now) : set_imu(now);
}

// Distributes the samples of the newest image between the two newest inertial factors. The instant
// of a state is stamp + offset. If it lies after the stamp, the samples between the two arrive with
// the next image. If it lies before the stamp, some samples of this image belong to the next
// factor.
bool FixedLagSmoother::share_samples() {
  const std::size_t now = window_.frames.size() - 1;
  WindowFrame& newest = window_.frames[now];
  WindowFrame& before = window_.frames[now - 1];
  const std::vector<ImuSample> own = newest.samples;
  if (own.empty()) return true;
  if (now == 1) before.gyro = gyro_at(own, before.instant());
  newest.samples = joined(before.samples, own, before.instant(), newest.samples.back().stamp);
  if (now < 2 || before.imu->rests() || !(before.offset_s > 0.0)) return true;
  before.samples = joined(before.samples, own, window_.frames[now - 2].instant(), before.instant());
  return set_imu(now - 1);
}

bool FixedLagSmoother::set_imu(std::size_t frame) {
  const WindowFrame& before = window_.frames[frame - 1];
  WindowFrame& f = window_.frames[frame];
  ImuNoise noise = noise_between(f.is_smooth, seconds_between(before.state.stamp, f.state.stamp));
  noise.gyro_noise_density *= gyro_noise_.scale();
  if (f.is_bridged) {
    noise.gyro_noise_density = std::max(noise.gyro_noise_density, kBridgeGyro);
    noise.accel_noise_density = std::max(noise.accel_noise_density, kBridgeAccel);
  }
  ImuPreintegration imu(noise, before.state.gyro_bias, before.state.accel_bias);
  std::vector<ImuSample> held;  // last sample, held until later samples arrive
  std::span<const ImuSample> samples = f.samples;
  if (frame + 1 == window_.frames.size() && !samples.empty() &&
      samples.back().stamp >= f.state.stamp && samples.back().stamp < f.instant()) {
    held = f.samples;
    held.push_back(held.back());
    held.back().stamp = f.instant();
    samples = held;
  }
  const bool covered = imu.add(samples, before.instant(), f.instant());
  f.imu = covered ? ImuFactor::of(imu, model_.config.gravity_mps2) : std::nullopt;
  if (f.imu) f.gyro = gyro_at(samples, f.instant());
  return f.imu.has_value();
}

ImuNoise FixedLagSmoother::noise_between(bool is_smooth, double dt_s) const {
  if (model_.is_measured) return noise_;
  const MotionNoise allowed{.accel = model_.config.motion_accel, .turn = model_.config.motion_turn};
  return virtual_imu_noise(is_smooth ? shown_motion_.noise(allowed) : allowed, dt_s);
}

// Last keyframe before the newest image; the first image if there is none.
std::size_t FixedLagSmoother::last_keyframe() const {
  std::size_t last = window_.frames.size() - 2;
  while (last > 0 && !window_.frames[last].keyframe) --last;
  return last;
}

void FixedLagSmoother::compare_gyro() {
  const WindowFrame& newest = window_.frames.back();
  const WindowFrame& before = window_.frames[window_.frames.size() - 2];
  const ImuPreintegration& imu = newest.imu->imu();
  const SE3 by_samples = predict(before.state, imu, model_.config.gravity_mps2).T_odom_body;
  const double scale = gyro_noise_.scale();
  gyro_noise_.add(angle_of(by_samples.linear().transpose() * newest.state.T_odom_body.linear()),
                  imu.covariance().topLeftCorner<3, 3>().trace() / (scale * scale), imu.dt_s());
}

std::size_t FixedLagSmoother::keyframes() const {
  return static_cast<std::size_t>(std::count_if(window_.frames.begin(), window_.frames.end(),
                                                [](const auto& f) { return f.keyframe; }));
}

void FixedLagSmoother::decide_keyframe() {
  const std::size_t now = window_.frames.size() - 1;
  WindowFrame& newest = window_.frames[now];
  if (newest.rests) {
    newest.keyframe = !window_.frames[now - 1].rests;
    return;
  }
  const std::size_t last = last_keyframe();
  const WindowFrame& keyframe = window_.frames[last];
  const double patience = locates_new(window_) ? 1.0 : kPatience;
  if (seconds_between(keyframe.state.stamp, newest.state.stamp) >= patience * kKeyframeInterval_s) {
    newest.keyframe = true;
    return;
  }
  const Eigen::Matrix3d R_last_now = R_cam_body_ * keyframe.state.T_odom_body.linear().transpose() *
                                     newest.state.T_odom_body.linear() * R_cam_body_.transpose();
  std::vector<double> parallax;
  int seen_in_keyframe = 0, seen_now = 0;
  for (const WindowLandmark& landmark : window_.landmarks) {
    const auto in_keyframe =
        std::find_if(landmark.observations.begin(), landmark.observations.end(),
                     [&](const WindowObservation& o) { return o.frame == last; });
    const bool in_newest = tracked_now(window_, landmark);
    seen_now += in_newest;
    if (in_keyframe == landmark.observations.end()) continue;
    ++seen_in_keyframe;
    if (!in_newest) continue;
    const Eigen::Vector3d p = R_last_now * landmark.observations.back().bearings[0]->homogeneous();
    parallax.push_back((p.head<2>() / p.z() - *in_keyframe->bearings[0]).norm());
  }
  if (seen_now < kMinKeyframeFeatures) return;
  // The window lacks some lost features of the keyframe. With an inertial sensor, motion is
  // also determined without common features.
  if (!model_.is_measured) seen_in_keyframe = keyframe.features;
  if (patience * static_cast<double>(parallax.size()) <= kKeyframeTrackedShare * seen_in_keyframe ||
      parallax.empty()) {
    newest.keyframe = true;
    return;
  }
  const auto median = parallax.begin() + static_cast<std::ptrdiff_t>(parallax.size() / 2);
  std::nth_element(parallax.begin(), median, parallax.end());
  newest.keyframe = *median * focal_px_ > patience * kKeyframeParallax_px;
}

void FixedLagSmoother::locate_landmarks() {
  const double max_error = model_.config.outlier_px / model_.config.noise_px;
  const std::vector<SE3> images = image_poses(window_);
  const auto behind = [&](const WindowLandmark& landmark) {
    const WindowObservation& o = landmark.observations.back();
    Eigen::Vector2d r;
    for (std::size_t c = 0; c < 2; ++c)
      if (o.bearings[c] && !reprojection_error(window_.views[c], *o.bearings[c], images[o.frame],
                                               landmark.p_odom, r))
        return true;
    return false;
  };
  for (WindowLandmark& landmark : window_.landmarks) {
    // The observations that determined the distance may have left the window.
    if (landmark.located && tracked_now(window_, landmark) && behind(landmark))
      landmark.located = false;
    if (!landmark.located && landmark.observations.size() >= 2)
      locate(window_, images, max_error, landmark);
  }
}

ImageFit FixedLagSmoother::fit_of_newest() const {
  const double limit = model_.config.outlier_px / model_.config.noise_px;
  const SE3 T_odom_body = image_poses(window_).back();
  ImageFit fit;
  Eigen::Vector2d r;
  for (const WindowLandmark& landmark : window_.landmarks) {
    if (!landmark.located || !tracked_now(window_, landmark)) continue;
    for (std::size_t c = 0; c < 2; ++c) {
      const auto& bearing = landmark.observations.back().bearings[c];
      if (!bearing) continue;
      const bool in_front =
          reprojection_error(window_.views[c], *bearing, T_odom_body, landmark.p_odom, r);
      ++fit.points;
      fit.contradicting += !in_front || r.squaredNorm() > limit * limit;
    }
  }
  return fit;
}

int FixedLagSmoother::reject_outliers() {
  const double limit = model_.config.outlier_px / model_.config.noise_px;
  const std::vector<SE3> images = image_poses(window_);
  int dropped = 0;
  Eigen::Vector2d r;
  for (WindowLandmark& landmark : window_.landmarks) {
    if (!landmark.located) continue;
    for (WindowObservation& o : landmark.observations)
      for (std::size_t c = 0; c < 2; ++c) {
        if (!o.bearings[c]) continue;
        if (reprojection_error(window_.views[c], *o.bearings[c], images[o.frame], landmark.p_odom,
                               r) &&
            r.squaredNorm() <= limit * limit)
          continue;
        o.bearings[c].reset();
        ++dropped;
      }
    std::erase_if(landmark.observations, [](const WindowObservation& o) { return !o.bearings[0]; });
    if (landmark.observations.size() < 2) landmark.located = false;
  }
  std::erase_if(window_.landmarks, [](const auto& l) { return l.observations.empty(); });
  return dropped;
}

bool FixedLagSmoother::leaves_next(Stamp stamp) const {
  const auto too_many = keyframes() > static_cast<std::size_t>(model_.config.window_keyframes);
  return window_.frames.empty() || stamp < window_.frames.front().state.stamp ||
         (too_many && stamp == window_.frames.front().state.stamp);
}

const WindowFrame* FixedLagSmoother::frame_at(Stamp stamp) const {
  const auto it = std::find_if(window_.frames.begin(), window_.frames.end(),
                               [&](const WindowFrame& f) { return f.state.stamp == stamp; });
  return it == window_.frames.end() ? nullptr : &*it;
}

std::optional<RelativeMotion> FixedLagSmoother::relative_pose(Stamp from, Stamp to) const {
  const WindowFrame* a = frame_at(from);
  const WindowFrame* b = frame_at(to);
  if (a == nullptr || b == nullptr) return std::nullopt;
  RelativeMotion result;
  result.T = a->state.T_odom_body.inverse() * b->state.T_odom_body;
  // xi = -Ad(T_to_from) xi_from + xi_to
  Eigen::MatrixXd D_T = Eigen::MatrixXd::Zero(variables(), 6);
  D_T.middleRows<6>(15 * (a - window_.frames.data())) = -adjoint(result.T.inverse()).transpose();
  D_T.middleRows<6>(15 * (b - window_.frames.data())) += Matrix6::Identity();
  WindowEquations equations(window_, 0.0);
  equations.add_all();
  Eigen::MatrixXd H = equations.H();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(H);
  if (llt.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd X = llt.solve(D_T);
  result.Sigma = D_T.transpose() * X;
  result.Sigma = 0.5 * (result.Sigma + result.Sigma.transpose()).eval();
  result.error_ratio = equations.error_ratio(X);
  return result;
}

std::optional<StateCovariance> FixedLagSmoother::state_covariance(Stamp stamp) const {
  const WindowFrame* frame = frame_at(stamp);
  if (frame == nullptr) return std::nullopt;
  Eigen::MatrixXd D_T = Eigen::MatrixXd::Zero(variables(), 11);
  D_T.middleRows<15>(15 * (frame - window_.frames.data())) =
      without_gauge(frame->state).transpose();
  const auto Sigma = covariance_of(std::move(D_T));
  if (!Sigma) return std::nullopt;
  // Rounding leaves neither triangle exact.
  return StateCovariance(Sigma->selfadjointView<Eigen::Upper>());
}

// Returns the clock offset of the first frame. The state of a frame is at the stamp of its image
// plus the offset. An offset below 0 becomes 0 if all samples are later than that time, because the
// next inertial factor could not start there.
double FixedLagSmoother::first_offset_s(const InertialFrame& frame) const {
  const double offset_s = std::clamp(window_.calibration.offset_s, -kMostOffset_s, kMostOffset_s);
  const Stamp instant = frame.tracked.stamp + nanoseconds(offset_s);
  const bool is_covered = !frame.samples.empty() && frame.samples.front().stamp <= instant;
  return is_covered ? offset_s : std::max(offset_s, 0.0);
}

double FixedLagSmoother::next_offset_s(const InertialFrame& frame) const {
  const WindowFrame& before = window_.frames.back();
  const double step = kMostOffsetStep * seconds_between(before.state.stamp, frame.tracked.stamp);
  const double wanted = std::clamp(window_.calibration.offset_s, -kMostOffset_s, kMostOffset_s);
  return std::clamp(wanted, before.offset_s - step, before.offset_s + step);
}

// Sigma = D H^-1 D^T = |L^-1 D^T|^2.
std::optional<Eigen::MatrixXd> FixedLagSmoother::covariance_of(Eigen::MatrixXd D_T) const {
  WindowEquations equations(window_, 0.0);
  equations.add_all();
  Eigen::MatrixXd H = equations.H();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(H);
  if (llt.info() != Eigen::Success) return std::nullopt;
  llt.matrixL().solveInPlace(D_T);
  return D_T.transpose() * D_T;
}

void FixedLagSmoother::set_first_prior() {
  const OdometryState& first = window_.frames.front().state;
  StatePrior& prior = window_.prior;
  prior.frames = {window_.frames.front().id};
  prior.linearization = {first};
  prior.J = Eigen::MatrixXd::Zero(model_.is_measured ? 10 : 15, 15);
  prior.J.topRows<4>() = held_gauge(first);
  prior.J.block<3, 3>(4, 9).diagonal().setConstant(1.0 / model_.gyro_bias_sigma_radps);
  prior.J.block<3, 3>(7, 12).diagonal().setConstant(1.0 / model_.config.accel_bias_sigma);
  if (!model_.is_measured) {  // nothing determines the tilt, and a single image no velocity
    prior.J.block<2, 3>(10, 0) = first.T_odom_body.linear().topRows<2>() / kHeldHeading_rad;
    prior.J.block<3, 3>(12, 6).diagonal().setConstant(1.0 / model_.config.max_speed_mps);
  }
  hold_calibration();
}

void FixedLagSmoother::hold_calibration() {
  StatePrior& prior = window_.prior;
  prior.calibrates = window_.calibrates;
  prior.calibration = window_.calibration;
  if (prior.calibrates) {
    const Eigen::Index rows = prior.J.rows(), columns = prior.J.cols();
    prior.J.conservativeResizeLike(
        Eigen::MatrixXd::Zero(rows + kCalibrationSize, columns + kCalibrationSize));
    prior.J.bottomRightCorner<kCalibrationSize, kCalibrationSize>() =
        calibration_covariance_.llt().matrixL().solve(CalibrationMatrix::Identity());
  }
  prior.r = Eigen::VectorXd::Zero(prior.J.rows());
}

UncertainCalibration FixedLagSmoother::calibration() const {
  UncertainCalibration result{window_.calibration, calibration_covariance_};
  if (!window_.calibrates || window_.frames.empty()) return result;
  Eigen::MatrixXd D_T = Eigen::MatrixXd::Zero(variables(), kCalibrationSize);
  D_T.bottomRows<kCalibrationSize>().setIdentity();
  if (const auto Sigma = covariance_of(std::move(D_T))) result.covariance = *Sigma;
  return result;
}

CalibrationMatrix FixedLagSmoother::calibration_prior() const {
  CalibrationVector sigma;
  sigma << model_.config.calibration_offset_s, Eigen::Vector3d::Constant(kMountingRotation_rad),
      Eigen::Vector3d::Constant(kMountingTranslation_m), model_.config.calibration_readout_s;
  return sigma.cwiseAbs2().asDiagonal();
}

Eigen::Index FixedLagSmoother::variables() const {
  return 15 * static_cast<Eigen::Index>(window_.frames.size()) +
         (window_.calibrates ? kCalibrationSize : 0);
}

bool FixedLagSmoother::slide(bool rests) {
  for (std::size_t k = window_.frames.size(); k-- > 1;) {
    WindowFrame& frame = window_.frames[k];
    const bool recent = k + kRecentImages >= window_.frames.size();
    if (recent || frame.keyframe) continue;
    if (rests && frame.rests && window_.frames[k - 1].rests)
      drop_at_rest(k);
    else if (frame.imu->rests())
      frame.keyframe = true;  // the last image at rest: later poses are measured from it
    else if (!drop_and_merge(k))
      return false;
  }
  while (keyframes() > static_cast<std::size_t>(model_.config.window_keyframes))
    marginalize_oldest(window_);
  const auto gone = [&](const WindowLandmark& landmark) {
    return landmark.observations.size() < 2 && !tracked_now(window_, landmark);
  };
  std::erase_if(window_.landmarks, gone);
  return true;
}

bool FixedLagSmoother::drop_and_merge(std::size_t frame) {
  std::vector<ImuSample>& later = window_.frames[frame + 1].samples;
  later = joined(window_.frames[frame].samples, later, window_.frames[frame - 1].instant(),
                 window_.frames[frame + 1].instant());
  window_.frames[frame + 1].is_bridged |= window_.frames[frame].is_bridged;
  window_.frames[frame + 1].is_smooth &= window_.frames[frame].is_smooth;
  forget_frame(window_, frame);
  return set_imu(frame);
}

void FixedLagSmoother::drop_at_rest(std::size_t frame) {
  forget_frame(window_, frame);
  const auto in_keyframe = [&](const WindowObservation& o) {
    return window_.frames[o.frame].keyframe;
  };
  for (WindowLandmark& landmark :
       window_.landmarks)  // without an observation in a keyframe the distance is undetermined
    if (std::ranges::none_of(landmark.observations, in_keyframe)) landmark.located = false;
  WindowFrame& later = window_.frames[frame];
  const double dt_s = seconds_between(window_.frames[frame - 1].state.stamp, later.state.stamp);
  later.imu = ImuFactor::at_rest(noise_between(false, dt_s), dt_s);
}

}  // namespace km
