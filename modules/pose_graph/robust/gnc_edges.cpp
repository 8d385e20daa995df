#include "modules/pose_graph/robust/gnc_edges.hpp"

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "modules/core/precision.hpp"

namespace km {

double edge_residual(const SE3& T_world_i, const SE3& T_world_j, const SE3& T_i_j, double kappa,
                     double tau) {
  const SE3 predicted = T_world_i * T_i_j;
  return std::sqrt(kappa * (T_world_j.linear() - predicted.linear()).squaredNorm() +
                   tau * (T_world_j.translation() - predicted.translation()).squaredNorm());
}

std::vector<SE3> start_from_odometry(const GncEdges& edges) {
  const RobotEdges& robot = edges.edges;
  std::vector<std::optional<SE3>> reached(static_cast<std::size_t>(robot.poses));
  if (!reached.empty()) reached[0] = SE3::Identity();
  // One more pose across an edge of which one end is reached; odometry goes first.
  const auto reach_on = [&](bool odometry) {
    bool any = false;
    for (std::size_t k = 0; k < robot.own.size(); ++k) {
      if (edges.own_odometry[k] != odometry) continue;
      const BlockEdge& e = robot.own[k];
      auto& i = reached.at(static_cast<std::size_t>(e.i));
      auto& j = reached.at(static_cast<std::size_t>(e.j));
      if (i.has_value() == j.has_value()) continue;
      if (i)
        j = *i * e.T_i_j;
      else
        i = *j * e.T_i_j.inverse();
      any = true;
      if (!odometry) break;
    }
    return any;
  };
  while (reach_on(true) || reach_on(false)) continue;
  std::vector<SE3> poses;
  for (const std::optional<SE3>& T : reached) {
    if (!T)
      throw std::invalid_argument("start_from_odometry: no edge of robot " +
                                  std::to_string(robot.self) + " leads to its pose " +
                                  std::to_string(poses.size()));
    poses.push_back(*T);
  }
  return poses;
}

Matrix6 edge_covariance(const BlockEdge& e, int dimension) {
  Matrix6 Sigma = covariance_of({e.kappa, e.tau});
  if (dimension == 3) return Sigma;
  Sigma(0, 0) = Sigma(1, 1) = Sigma(5, 5) = 0.0;  // roll, pitch, z
  Sigma(2, 2) = 1.0 / e.kappa;
  return Sigma;
}

}  // namespace km
