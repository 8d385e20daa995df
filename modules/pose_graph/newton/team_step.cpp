#include "modules/pose_graph/newton/team_step.hpp"

#include "modules/pose_graph/newton/edge_model.hpp"
#include "modules/pose_graph/newton/robot_system.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// A rigid motion of everything, to first order: rotation `w` [rad] and translation `u`, in world.
struct Drift {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  Eigen::Vector3d u = Eigen::Vector3d::Zero();

  [[nodiscard]] Vector6 of(const SE3& T) const {
    Vector6 xi;
    xi << T.linear().transpose() * w, T.linear().transpose() * (w.cross(T.translation()) + u);
    return xi;
  }
};

Drift opposite_of_mean(const std::vector<SE3>& poses, const MatrixXd& step, bool upright) {
  const double share = 1.0 / static_cast<double>(poses.size());
  const auto xi = [&](std::size_t s) { return tangent_of(step.col(static_cast<Index>(s))); };
  Drift drift;
  for (std::size_t s = 0; s < poses.size(); ++s)
    drift.w -= share * (poses[s].linear() * xi(s).head<3>());
  if (upright) drift.w.head<2>().setZero();
  for (std::size_t s = 0; s < poses.size(); ++s)
    drift.u -=
        share * (poses[s].linear() * xi(s).tail<3>() + drift.w.cross(poses[s].translation()));
  return drift;
}

void add(const Drift& drift, const std::vector<SE3>& poses, MatrixXd& step) {
  for (std::size_t k = 0; k < poses.size(); ++k)
    step.col(static_cast<Index>(k)) += step_of(drift.of(poses[k]), step.rows());
}

}  // namespace

void remove_drift(TeamStep& step, const std::vector<SE3>& node_poses,
                  const std::vector<SE3>& separator_poses, bool upright) {
  const Drift drift = opposite_of_mean(separator_poses, step.separators, upright);
  add(drift, separator_poses, step.separators);
  add(drift, node_poses, step.nodes);
}

std::vector<SE3> moved(const std::vector<SE3>& poses, const MatrixXd& step, double scale) {
  std::vector<SE3> result;
  result.reserve(poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k)
    result.push_back(move_along(poses[k], scale * tangent_of(step.col(static_cast<Index>(k)))));
  return result;
}

}  // namespace km
