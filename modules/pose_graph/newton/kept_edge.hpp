#pragma once

#include <Eigen/Geometry>

#include "modules/core/geometry.hpp"
#include "modules/pose_graph/newton/edge_model.hpp"

namespace km {

/// A rigid transform in single precision, as it crosses the network.
struct SinglePose {
  Eigen::Quaternionf q = Eigen::Quaternionf::Identity();
  Eigen::Vector3f t = Eigen::Vector3f::Zero();

  [[nodiscard]] static SinglePose of(const SE3& T) {
    return {Eigen::Quaterniond(T.linear()).cast<float>(), T.translation().cast<float>()};
  }
  [[nodiscard]] SE3 pose() const {
    return make_pose(q.cast<double>().normalized().toRotationMatrix(), t.cast<double>());
  }
};

/// An edge between two poses that its robot keeps: not its second derivatives but what they are
/// made of is told. That is a seventh of the bytes, and single precision does no harm to soft
/// modes: rounded, it still is an edge, which resists no motion of the whole.
struct KeptEdge {
  int pair = 0;             ///< The coupling of the robot's Schur complement it adds to.
  bool transposed = false;  ///< It leads from the second pose of that pair to the first.
  float kappa = 0.0F;
  float tau = 0.0F;
  SinglePose present;   ///< T_i_j at the poses the equations belong to.
  SinglePose measured;  ///< Of no effect on Gauss-Newton's derivatives.

  [[nodiscard]] EdgeModel model(Curvature curvature) const {
    const BlockEdge edge{0, 1, curvature == Curvature::kFull ? measured.pose() : present.pose(),
                         static_cast<double>(kappa), static_cast<double>(tau)};
    return model_edge(edge, SE3::Identity(), present.pose(), curvature);
  }
};

}  // namespace km
