#pragma once

#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>

#include "modules/core/geometry.hpp"

namespace km {

// The terms of deformation_terms.hpp for Ceres. A pose block is a quaternion x, y, z, w, then a
// translation. Costs deliver derivatives by the six tangent coordinates in the first six of the
// seven columns of a block; the manifold's PlusJacobian passes these on.

using GraphPose = std::array<double, 7>;

[[nodiscard]] GraphPose to_graph_pose(const SE3& T);
[[nodiscard]] SE3 from_graph_pose(const double* block);

/// retract() and local_coordinates() on pose blocks.
class GraphPoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// Rigidity between two nodes, in both directions. Blocks: node k, node l.
class MeshEdgeCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  /// `offset`: g_l - g_k [m]; `weight`: 1 / sigma [1/m].
  MeshEdgeCost(const Eigen::Vector3d& offset, double weight) : offset_(offset), weight_(weight) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Vector3d offset_;
  double weight_;
};

/// Rigidity between a keyframe and a node it saw, and how both turned. Blocks: keyframe, node.
class KeyframeTieCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  /// Weights are 1 / sigma: [1/m], [1/rad].
  KeyframeTieCost(const SE3& T_odom_kf, const Eigen::Vector3d& g_node, double position_weight,
                  double rotation_weight);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Matrix3d R_odom_kf_;
  Eigen::Vector3d g_kf_;  // the node in the keyframe, undeformed
  double position_weight_;
  double rotation_weight_;
};

/// Holds a keyframe at its optimised pose. Block: keyframe.
class AnchorCost final : public ceres::SizedCostFunction<6, 7> {
 public:
  AnchorCost(const SE3& anchor, double rotation_weight, double translation_weight)
      : anchor_(anchor),
        rotation_weight_(rotation_weight),
        translation_weight_(translation_weight) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  SE3 anchor_;
  double rotation_weight_;
  double translation_weight_;
};

}  // namespace km
