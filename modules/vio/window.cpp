#include "modules/vio/window.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

namespace km {
namespace {

constexpr int kRefinements = 3;
constexpr double kMaxRelativeSigma = 1.0 / 3.0;

// Minimises the sum of squared distances to all rays.
std::optional<Eigen::Vector3d> nearest_to_rays(const Window& window, std::span<const SE3> images,
                                               const WindowLandmark& landmark) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const WindowObservation& o : landmark.observations)
    for (std::size_t c = 0; c < 2; ++c) {
      if (!o.bearings[c]) continue;
      const ViewModel& view = window.views[c];
      const SE3& T_odom_body = images[o.frame];
      const Eigen::Matrix3d R_odom_cam = T_odom_body.linear() * view.R_cam_body.transpose();
      const Eigen::Vector3d origin = T_odom_body.translation() - R_odom_cam * view.t_cam_body;
      const Eigen::Vector3d ray = (R_odom_cam * o.bearings[c]->homogeneous()).normalized();
      const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - ray * ray.transpose();
      A += P;
      b += P * origin;
    }
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
  if (ldlt.info() != Eigen::Success || ldlt.vectorD().minCoeff() < 1e-10) return std::nullopt;
  return ldlt.solve(b);
}

// Moves the bearings to the stamp for a readout time that is longer by `longer_s`.
void move_by_readout(double longer_s, WindowObservation& observation) {
  for (std::size_t c = 0; c < 2; ++c)
    if (observation.bearings[c]) *observation.bearings[c] -= longer_s * observation.by_readout[c];
}

struct PointEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double squared_error = 0.0;
  int count = 0;
};

std::optional<PointEquations> equations(const Window& window, std::span<const SE3> images,
                                        const WindowLandmark& landmark,
                                        const Eigen::Vector3d& p_odom) {
  PointEquations e;
  ReprojectionTerm term;
  for (const WindowObservation& o : landmark.observations)
    for (std::size_t c = 0; c < 2; ++c) {
      if (!o.bearings[c]) continue;
      const SE3& T = images[o.frame];
      if (!linearize_reprojection(window.views[c], *o.bearings[c], T, T, p_odom, term))
        return std::nullopt;
      e.H.noalias() += term.J_point.transpose() * term.J_point;
      e.g.noalias() += term.J_point.transpose() * term.r;
      e.squared_error += term.r.squaredNorm();
      ++e.count;
    }
  return e;
}

}  // namespace

std::size_t frame_index(const Window& window, std::uint64_t id) {
  const auto it = std::lower_bound(window.frames.begin(), window.frames.end(), id,
                                   [](const WindowFrame& f, std::uint64_t v) { return f.id < v; });
  const auto index = static_cast<std::size_t>(it - window.frames.begin());
  return it != window.frames.end() && it->id == id ? index : window.frames.size();
}

std::vector<FirstEstimate> first_estimates(const Window& window) {
  std::vector<FirstEstimate> result(window.frames.size());
  for (std::size_t k = 0; k < window.prior.frames.size(); ++k) {
    FirstEstimate& estimate = result[frame_index(window, window.prior.frames[k])];
    estimate.pose = window.prior.linearization[k].T_odom_body;
    if (k == 0) estimate.motion = window.prior.linearization[k];
  }
  return result;
}

void calibrate(Window& window, const CameraCalibration& calibration) {
  const double longer_s = calibration.readout_s - window.calibration.readout_s;
  if (longer_s != 0.0)
    for (WindowLandmark& landmark : window.landmarks)
      for (WindowObservation& o : landmark.observations) move_by_readout(longer_s, o);
  window.calibration = calibration;
  const SE3 T_rig_body = calibration.T_body_rig.inverse();
  for (std::size_t c = 0; c < 2; ++c) {
    const ViewModel& rig = window.rig_views[c];
    window.views[c].R_cam_body = rig.R_cam_body * T_rig_body.linear();
    window.views[c].t_cam_body = rig.R_cam_body * T_rig_body.translation() + rig.t_cam_body;
    window.views[c].weight = rig.weight;
  }
}

ImagePose image_pose(const Window& window, const WindowFrame& frame, const OdometryState& state) {
  return ImagePose::at(state, frame.gyro, window.calibration.offset_s - frame.offset_s);
}

std::vector<SE3> image_poses(const Window& window) {
  std::vector<SE3> poses;
  for (const WindowFrame& frame : window.frames)
    poses.push_back(window.calibrates ? image_pose(window, frame, frame.state).T_odom_body
                                      : frame.state.T_odom_body);
  return poses;
}

void observe(Window& window, const TrackedFrame& tracked) {
  std::vector<WindowLandmark> added;
  auto at = window.landmarks.begin();
  for (const TrackedFeature& feature :
       tracked.features) {  // both lists ascend, so one pass suffices
    WindowObservation observation{window.frames.size() - 1,
                                  {feature.left, feature.right},
                                  {feature.left_by_readout, feature.right_by_readout}};
    move_by_readout(window.calibration.readout_s, observation);
    while (at != window.landmarks.end() && at->id < feature.id) ++at;
    if (at != window.landmarks.end() && at->id == feature.id)
      at->observations.push_back(observation);
    else
      added.push_back({feature.id, Eigen::Vector3d::Zero(), false, {observation}});
  }
  const auto middle = static_cast<std::ptrdiff_t>(window.landmarks.size());
  std::move(added.begin(), added.end(), std::back_inserter(window.landmarks));
  std::inplace_merge(window.landmarks.begin(), window.landmarks.begin() + middle,
                     window.landmarks.end(),
                     [](const auto& a, const auto& b) { return a.id < b.id; });
}

bool tracked_now(const Window& window, const WindowLandmark& landmark) {
  return !landmark.observations.empty() &&
         landmark.observations.back().frame + 1 == window.frames.size();
}

void locate(const Window& window, std::span<const SE3> images, double max_error,
            WindowLandmark& landmark) {
  landmark.located = false;
  std::optional<Eigen::Vector3d> p = nearest_to_rays(window, images, landmark);
  if (!p) return;
  for (int k = 0; k < kRefinements; ++k) {
    const auto e = equations(window, images, landmark, *p);
    if (!e) return;
    *p -= e->H.ldlt().solve(e->g);
  }
  const auto e = equations(window, images, landmark, *p);
  if (!e || e->squared_error > e->count * max_error * max_error) return;
  const Eigen::Vector3d ray = *p - images[landmark.observations.back().frame].translation();
  const double range = ray.norm();
  const double variance = ray.dot(e->H.ldlt().solve(ray)) / (range * range);
  if (!(variance < std::pow(kMaxRelativeSigma * range, 2))) return;
  landmark.p_odom = *p;
  landmark.located = true;
}

}  // namespace km
