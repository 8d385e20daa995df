#include "modules/vio/stereo_odometry.hpp"

#include <Eigen/Cholesky>

#include "modules/core/lie.hpp"
#include "modules/vio/triangulation.hpp"

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

// Pose of the last frame on the landmarks located so far; false if there are too few.
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

}  // namespace

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
    for (WindowLandmark& landmark : window.landmarks)
      if (!landmark.located && tracked_now(window, landmark)) locate(window, max_error, landmark);
  }
  std::vector<SE3> poses;
  const SE3 T_first = window.frames.front().state.T_odom_body.inverse();
  for (const WindowFrame& frame : window.frames) poses.push_back(T_first * frame.state.T_odom_body);
  return poses;
}

}  // namespace km
