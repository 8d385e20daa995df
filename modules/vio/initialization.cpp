#include "modules/vio/initialization.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "modules/core/geometry/lie.hpp"
#include "modules/vio/motion_model.hpp"
#include "modules/vio/rest_detector.hpp"
#include "modules/vio/window.hpp"

namespace km {
namespace {

constexpr int kMinLandmarks = 12;
constexpr int kPoseIterations = 15;

Window empty_window(const SensorRig& rig, const VioConfig& config) {
  Window window;
  for (std::size_t c = 0; c < 2; ++c)
    window.views[c] = view_model(rig.stereo.cameras[c], config.noise_px);
  window.gravity_mps2 = config.gravity_mps2;
  window.loss_scale = config.loss_scale;
  return window;
}

// Estimates the pose of the last frame from the located landmarks; false if too few are seen.
bool resect(Window& window) {
  SE3& T = window.frames.back().state.T_odom_body;
  ReprojectionTerm term;
  int landmarks = 0;
  for (int k = 0; k < kPoseIterations; ++k) {
    Matrix6 H = Matrix6::Zero();
    Vector6 g = Vector6::Zero();
    landmarks = 0;
    for (const WindowLandmark& landmark : window.landmarks) {
      if (!landmark.located || !tracked_now(window, landmark)) continue;
      ++landmarks;
      for (std::size_t c = 0; c < 2; ++c) {
        const auto& bearing = landmark.observations.back().bearings[c];
        if (!bearing ||
            !linearize_reprojection(window.views[c], *bearing, T, T, landmark.p_odom, term))
          continue;
        const double scale = window.loss_scale;
        const double w = 1.0 / (1.0 + term.r.squaredNorm() / (scale * scale));
        H.noalias() += w * term.J_pose.transpose() * term.J_pose;
        g.noalias() += w * term.J_pose.transpose() * term.r;
      }
    }
    if (landmarks < kMinLandmarks) return false;
    const Vector6 step = -H.ldlt().solve(g);
    T = retract(T, step);
    if (step.cwiseAbs().maxCoeff() < 1e-7) break;
  }
  return T.matrix().allFinite();
}

// Poses T_first_body of consecutive images from stereo alone, or nullopt if an image shares too few
// located landmarks with earlier ones. `R_previous_current` are initial rotations, one for each
// image after the first. Landmarks are triangulated in the first image that shows them with depth.
// Poses are estimated one by one (Gauss-Newton on the reprojection errors). They are rough; the
// smoother refines them.
std::optional<std::vector<SE3>> stereo_odometry(std::span<const InertialFrame> frames,
                                                std::span<const Eigen::Matrix3d> R_previous_current,
                                                const SensorRig& rig, const VioConfig& config) {
  Window window = empty_window(rig, config);
  const double max_error = config.outlier_px / config.noise_px;
  SE3 last_motion = SE3::Identity();
  for (std::size_t k = 0; k < frames.size(); ++k) {
    WindowFrame& frame = window.frames.emplace_back();
    frame.id = k;
    frame.state.stamp = frames[k].tracked.stamp;
    if (k > 0) {
      const SE3& T_before = window.frames[k - 1].state.T_odom_body;
      frame.state.T_odom_body =
          T_before * make_pose(R_previous_current[k - 1], last_motion.translation());
    }
    observe(window, frames[k].tracked);
    if (k > 0) {
      if (!resect(window)) return std::nullopt;
      last_motion = window.frames[k - 1].state.T_odom_body.inverse() * frame.state.T_odom_body;
    }
    const std::vector<SE3> images = image_poses(window);
    for (WindowLandmark& landmark : window.landmarks)
      if (!landmark.located && tracked_now(window, landmark))
        locate(window, images, max_error, landmark);
  }
  std::vector<SE3> poses;
  const SE3 T_first = window.frames.front().state.T_odom_body.inverse();
  for (const WindowFrame& frame : window.frames) poses.push_back(T_first * frame.state.T_odom_body);
  return poses;
}

// Largest relative error of the measured length of gravity.
constexpr double kMaxGravityError = 0.25;
constexpr double kStereoPosition_m = 0.003;  // noise of a relative position from stereo
constexpr double kVelocityStep_mps = 0.005;  // noise of a preintegrated change of velocity
constexpr int kGyroBiasSteps = 4;
constexpr int kGravitySteps = 5;

using Preintegrations = std::vector<ImuPreintegration>;  // k: from image k to k + 1

std::optional<Preintegrations> preintegrate(std::span<const InertialFrame> frames,
                                            const ImuNoise& noise, const Eigen::Vector3d& bias) {
  Preintegrations all;
  for (std::size_t k = 1; k < frames.size(); ++k) {
    ImuPreintegration& imu = all.emplace_back(noise, bias, Eigen::Vector3d::Zero());
    if (!imu.add(frames[k].samples, frames[k - 1].tracked.stamp, frames[k].tracked.stamp))
      return std::nullopt;
  }
  return all;
}

// Means of the samples, and the difference between the means of both halves. Idling rotors cause
// large deviations but do not change the mean.
struct InertialMean {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = Eigen::Vector3d::Zero();
  double gyro_change = 0.0, accel_change = 0.0;
};

InertialMean inertial_mean(std::span<const InertialFrame> frames) {
  Eigen::Matrix<double, 3, 2> gyro = Eigen::Matrix<double, 3, 2>::Zero(), accel = gyro;
  Eigen::Vector2d count = Eigen::Vector2d::Zero();
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const Eigen::Index half = 2 * k < frames.size() ? 0 : 1;
    for (const ImuSample& sample : frames[k].samples) {
      gyro.col(half) += sample.gyro;
      accel.col(half) += sample.accel;
      count(half) += 1.0;
    }
  }
  InertialMean mean;
  mean.gyro = gyro.rowwise().sum() / count.sum();
  mean.accel = accel.rowwise().sum() / count.sum();
  mean.gyro_change = (gyro.col(1) / count(1) - gyro.col(0) / count(0)).norm();
  mean.accel_change = (accel.col(1) / count(1) - accel.col(0) / count(0)).norm();
  return mean;
}

// Gyro bias for which the preintegrated rotations are those of stereo (Gauss-Newton).
std::optional<Eigen::Vector3d> gyro_bias_from(std::span<const InertialFrame> frames,
                                              const std::vector<SE3>& poses,
                                              const ImuNoise& noise) {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  for (int step = 0; step < kGyroBiasSteps; ++step) {
    const auto imus = preintegrate(frames, noise, bias);
    if (!imus) return std::nullopt;
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < imus->size(); ++k) {
      const Eigen::Matrix3d R = poses[k].linear().transpose() * poses[k + 1].linear();
      const Eigen::Vector3d r = so3_log((*imus)[k].motion().dR.transpose() * R);
      H += (*imus)[k].dR_dbg().transpose() * (*imus)[k].dR_dbg();
      g += (*imus)[k].dR_dbg().transpose() * r;
    }
    bias += H.ldlt().solve(g);
  }
  return bias;
}

struct LinearAlignment {
  std::vector<Eigen::Vector3d> velocities;  // in the body frame of the first image
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
};

// Velocities, accelerometer bias and gravity = base + tangent * w from the linear relations
//   p_j - p_i = v_i dt + g dt^2/2 + R_i (dp + dp_dba b),   v_j - v_i = g dt + R_i (dv + dv_dba b).
LinearAlignment solve_alignment(const std::vector<SE3>& poses, const Preintegrations& imus,
                                double accel_bias_sigma, const Eigen::Vector3d& base,
                                const Eigen::MatrixXd& tangent) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  const Eigen::Index at_g = 3 * n, at_b = at_g + tangent.cols();
  const Eigen::Index rows = 6 * (n - 1);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(rows + 3, at_b + 3);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(rows + 3);
  for (Eigen::Index k = 0; k + 1 < n; ++k) {
    const ImuPreintegration& imu = imus[static_cast<std::size_t>(k)];
    const SE3& T_i = poses[static_cast<std::size_t>(k)];
    const SE3& T_j = poses[static_cast<std::size_t>(k) + 1];
    const double dt = imu.dt_s();
    const double wp = 1.0 / kStereoPosition_m, wv = 1.0 / kVelocityStep_mps;
    auto p = A.middleRows<3>(6 * k);
    p.middleCols<3>(3 * k).diagonal().setConstant(wp * dt);
    p.middleCols(at_g, tangent.cols()) = wp * 0.5 * dt * dt * tangent;
    p.middleCols<3>(at_b) = wp * T_i.linear() * imu.dp_dba();
    y.segment<3>(6 * k) = wp * (T_j.translation() - T_i.translation() - 0.5 * dt * dt * base -
                                T_i.linear() * imu.motion().dp);
    auto v = A.middleRows<3>(6 * k + 3);
    v.middleCols<3>(3 * k + 3).diagonal().setConstant(wv);
    v.middleCols<3>(3 * k).diagonal().setConstant(-wv);
    v.middleCols(at_g, tangent.cols()) = -wv * dt * tangent;
    v.middleCols<3>(at_b) = -wv * T_i.linear() * imu.dv_dba();
    y.segment<3>(6 * k + 3) = wv * (dt * base + T_i.linear() * imu.motion().dv);
  }
  A.block<3, 3>(rows, at_b).diagonal().setConstant(1.0 / accel_bias_sigma);
  const Eigen::VectorXd x = A.colPivHouseholderQr().solve(y);
  LinearAlignment result;
  for (Eigen::Index k = 0; k < n; ++k) result.velocities.push_back(x.segment<3>(3 * k));
  result.gravity = base + tangent * x.segment(at_g, tangent.cols());
  result.accel_bias = x.tail<3>();
  return result;
}

// solve_alignment() with gravity on the sphere of its known length.
LinearAlignment align_gravity(const std::vector<SE3>& poses, const Preintegrations& imus,
                              double accel_bias_sigma, double gravity_mps2,
                              Eigen::Vector3d gravity) {
  LinearAlignment result;
  for (int step = 0; step < kGravitySteps; ++step) {
    const Eigen::Vector3d direction = gravity.normalized();
    Eigen::MatrixXd tangent(3, 2);
    tangent.col(0) = direction.unitOrthogonal();
    tangent.col(1) = direction.cross(tangent.col(0).head<3>());
    result = solve_alignment(poses, imus, accel_bias_sigma, gravity_mps2 * direction, tangent);
    gravity = result.gravity;
  }
  return result;
}

bool is_gravity(double length_mps2, double gravity_mps2) {  // false for NaN
  return std::abs(length_mps2 / gravity_mps2 - 1.0) < kMaxGravityError;
}

std::vector<OdometryState> states_at_rest(std::span<const InertialFrame> frames,
                                          const InertialMean& mean) {
  OdometryState state;
  state.T_odom_body.linear() = upright(mean.accel);
  state.gyro_bias = mean.gyro;
  std::vector<OdometryState> states(frames.size(), state);
  for (std::size_t k = 0; k < frames.size(); ++k) states[k].stamp = frames[k].tracked.stamp;
  return states;
}

}  // namespace

Eigen::Matrix3d upright(const Eigen::Vector3d& accel) {
  if (!(accel.norm() > 0.0)) throw std::invalid_argument("upright: the specific force is zero");
  return rotation_to_z(accel);
}

StartGuess guess_start(std::span<const InertialFrame> frames, const SensorRig& rig,
                       const VioConfig& config) {
  StartGuess guess;
  if (frames.size() < kMinStartImages) return guess;
  const InertialMean mean = inertial_mean(frames);
  const double focal_px = rig.stereo.cameras[0].fx;
  const auto motion_px = image_motion_px(frames.front().tracked, frames.back().tracked, focal_px);
  const bool weighs = is_gravity(mean.accel.norm(), config.gravity_mps2);
  if (motion_px && weighs && *motion_px < kRestParallax_px && mean.accel_change < kRestAccel_mps2 &&
      mean.gyro_change < kRestGyro_radps) {
    guess.status = StartStatus::kAtRest;
    guess.states = states_at_rest(frames, mean);
    return guess;
  }
  guess.status = StartStatus::kInconsistent;
  const auto rotations = preintegrate(frames, rig.imu, Eigen::Vector3d::Zero());
  if (!rotations) return guess;
  std::vector<Eigen::Matrix3d> R_previous_current;
  for (const auto& imu : *rotations) R_previous_current.push_back(imu.motion().dR);
  const auto poses = stereo_odometry(frames, R_previous_current, rig, config);
  if (!poses) {
    guess.status = StartStatus::kTooFewFeatures;
    return guess;
  }
  const auto gyro_bias = gyro_bias_from(frames, *poses, rig.imu);
  const auto imus = preintegrate(frames, rig.imu, *gyro_bias);
  const LinearAlignment free =
      solve_alignment(*poses, *imus, config.accel_bias_sigma, Eigen::Vector3d::Zero(),
                      Eigen::MatrixXd::Identity(3, 3));
  if (!is_gravity(free.gravity.norm(), config.gravity_mps2)) return guess;
  const LinearAlignment aligned =
      align_gravity(*poses, *imus, config.accel_bias_sigma, config.gravity_mps2, free.gravity);
  if (!is_gravity(aligned.gravity.norm(), config.gravity_mps2)) return guess;
  const Eigen::Matrix3d R_odom_first = upright(-aligned.gravity);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    OdometryState& state = guess.states.emplace_back();
    state.stamp = frames[k].tracked.stamp;
    state.T_odom_body = make_pose(R_odom_first, Eigen::Vector3d::Zero()) * (*poses)[k];
    state.v_odom = R_odom_first * aligned.velocities[k];
    state.gyro_bias = *gyro_bias;
    state.accel_bias = aligned.accel_bias;
  }
  guess.status = StartStatus::kInMotion;
  return guess;
}

StartGuess guess_start_by_images(const InertialFrame& frame, const SensorRig& rig) {
  constexpr std::ptrdiff_t kMinLocatable = 20;
  StartGuess guess;
  guess.status = StartStatus::kTooFewFeatures;
  const auto& features = frame.tracked.features;
  if (std::ranges::count_if(features, [](const auto& f) { return f.right.has_value(); }) <
      kMinLocatable)
    return guess;
  guess.status = StartStatus::kByImages;
  OdometryState& state = guess.states.emplace_back();
  state.stamp = frame.tracked.stamp;
  state.T_odom_body.linear() = level_with_camera(rig.stereo.cameras[0].T_body_cam);
  return guess;
}

}  // namespace km
