#include "modules/mesh_deformation/deformation_costs.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "modules/core/lie.hpp"
#include "modules/mesh_deformation/deformation_terms.hpp"

namespace km {
namespace {

using Jacobian67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

// Rows of two 3 x 6 derivatives, one above the other, with an empty seventh column.
void store(double* jacobian, const Matrix36& upper, const Matrix36& lower) {
  Eigen::Map<Jacobian67> J(jacobian);
  J.topLeftCorner<3, 6>() = upper;
  J.bottomLeftCorner<3, 6>() = lower;
  J.col(6).setZero();
}

}  // namespace

GraphPose to_graph_pose(const SE3& T) {
  const Eigen::Quaterniond q(T.linear());
  const auto& t = T.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

SE3 from_graph_pose(const double* block) {
  const Eigen::Map<const Eigen::Quaterniond> q(block);
  return make_pose(q.toRotationMatrix(), Eigen::Map<const Eigen::Vector3d>(block + 4));
}

bool GraphPoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const GraphPose moved =
      to_graph_pose(retract(from_graph_pose(x), Eigen::Map<const Vector6>(delta)));
  std::copy(moved.begin(), moved.end(), x_plus_delta);
  return true;
}

bool GraphPoseManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool GraphPoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector6>{y_minus_x} = local_coordinates(from_graph_pose(x), from_graph_pose(y));
  return true;
}

bool GraphPoseManifold::MinusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool MeshEdgeCost::Evaluate(double const* const* parameters, double* residuals,
                            double** jacobians) const {
  const SE3 k = from_graph_pose(parameters[0]);
  const SE3 l = from_graph_pose(parameters[1]);
  const RigidityTerm forth = rigidity_term(k, offset_, l);
  const RigidityTerm back = rigidity_term(l, -offset_, k);
  Eigen::Map<Vector6> r(residuals);
  r << weight_ * forth.residual, weight_ * back.residual;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) store(jacobians[0], weight_ * forth.by_a, weight_ * back.by_b);
  if (jacobians[1] != nullptr) store(jacobians[1], weight_ * forth.by_b, weight_ * back.by_a);
  return true;
}

KeyframeTieCost::KeyframeTieCost(const SE3& T_odom_kf, const Eigen::Vector3d& g_node,
                                 double position_weight, double rotation_weight)
    : R_odom_kf_(T_odom_kf.linear()),
      g_kf_(T_odom_kf.inverse() * g_node),
      position_weight_(position_weight),
      rotation_weight_(rotation_weight) {}

bool KeyframeTieCost::Evaluate(double const* const* parameters, double* residuals,
                               double** jacobians) const {
  const SE3 keyframe = from_graph_pose(parameters[0]);
  const SE3 node = from_graph_pose(parameters[1]);
  const RigidityTerm position = rigidity_term(keyframe, g_kf_, node);
  const RotationTerm rotation = rotation_term(R_odom_kf_, keyframe, node);
  Eigen::Map<Vector6> r(residuals);
  r << position_weight_ * position.residual, rotation_weight_ * rotation.residual;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr)
    store(jacobians[0], position_weight_ * position.by_a, rotation_weight_ * rotation.by_keyframe);
  if (jacobians[1] != nullptr)
    store(jacobians[1], position_weight_ * position.by_b, rotation_weight_ * rotation.by_node);
  return true;
}

bool AnchorCost::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  const AnchorTerm term = anchor_term(anchor_, from_graph_pose(parameters[0]));
  Eigen::Map<Vector6> r(residuals);
  r << rotation_weight_ * term.residual.head<3>(), translation_weight_ * term.residual.tail<3>();
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  store(jacobians[0], rotation_weight_ * term.by_pose.topRows<3>(),
        translation_weight_ * term.by_pose.bottomRows<3>());
  return true;
}

}  // namespace km
