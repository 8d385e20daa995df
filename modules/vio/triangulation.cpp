#include "modules/vio/triangulation.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>

namespace km {
namespace {

constexpr int kRefinements = 3;
constexpr double kMaxRelativeSigma = 1.0 / 3.0;

// Least squares of the distances to all rays.
std::optional<Eigen::Vector3d> nearest_to_rays(const Window& window,
                                               const WindowLandmark& landmark) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const WindowObservation& o : landmark.observations)
    for (std::size_t c = 0; c < 2; ++c) {
      if (!o.bearings[c]) continue;
      const ViewModel& view = window.views[c];
      const SE3& T_odom_body = window.frames[o.frame].state.T_odom_body;
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

struct PointEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double squared_error = 0.0;
  int count = 0;
};

std::optional<PointEquations> equations(const Window& window, const WindowLandmark& landmark,
                                        const Eigen::Vector3d& p_odom) {
  PointEquations e;
  ReprojectionTerm term;
  for (const WindowObservation& o : landmark.observations)
    for (std::size_t c = 0; c < 2; ++c) {
      if (!o.bearings[c]) continue;
      const SE3& T = window.frames[o.frame].state.T_odom_body;
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

void locate(const Window& window, double max_error, WindowLandmark& landmark) {
  landmark.located = false;
  std::optional<Eigen::Vector3d> p = nearest_to_rays(window, landmark);
  if (!p) return;
  for (int k = 0; k < kRefinements; ++k) {
    const auto e = equations(window, landmark, *p);
    if (!e) return;
    *p -= e->H.ldlt().solve(e->g);
  }
  const auto e = equations(window, landmark, *p);
  if (!e || e->squared_error > e->count * max_error * max_error) return;
  const Eigen::Vector3d ray =
      *p - window.frames[landmark.observations.back().frame].state.T_odom_body.translation();
  const double range = ray.norm();
  const double variance = ray.dot(e->H.ldlt().solve(ray)) / (range * range);
  if (!(variance < std::pow(kMaxRelativeSigma * range, 2))) return;
  landmark.p_odom = *p;
  landmark.located = true;
}

}  // namespace km
