#pragma once

#include <map>
#include <vector>

#include "modules/pose_graph/newton/robot_graph.hpp"

namespace km {

/// A robot's edges, and which of them are odometry. Edges to a peer are in the same order as the
/// peer has them.
struct GncEdges {
  RobotEdges edges;
  std::vector<bool> own_odometry = {};
  std::map<RobotId, std::vector<bool>> odometry_to = {};
};

/// A robot's poses chained along its odometry, and where that is interrupted along closures inside
/// the robot; pose 0 is the identity. Throws std::invalid_argument if a pose is not reached.
[[nodiscard]] std::vector<SE3> start_from_odometry(const GncEdges& edges);

/// Length of the residual of an edge, the square root of its cost: kappa |R_j - R_i R_ij|^2 + tau
/// |t_j - t_i - R_i t_ij|^2 is, for small Gaussian noise with these weights, chi-squared.
[[nodiscard]] double edge_residual(const SE3& T_world_i, const SE3& T_world_j, const SE3& T_i_j,
                                   double kappa, double tau);

/// What the weights of an edge say of its covariance, tangent [rotation; translation]. In the plane
/// kappa is that of the angle (see precision_of_blocks()), and other directions have none.
[[nodiscard]] Matrix6 edge_covariance(const BlockEdge& e, int dimension);

}  // namespace km
