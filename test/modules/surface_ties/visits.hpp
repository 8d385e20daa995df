#pragma once

#include <cmath>
#include <set>
#include <vector>

#include "modules/core/covariance.hpp"
#include "modules/core/lie.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_origin.hpp"
#include "modules/mesh/seen_by.hpp"
#include "test/modules/surface_ties/rooms.hpp"

namespace km {

/// A robot that moves in a circle through the room of inside_of_room(). Between the keyframes
/// kDrifts its odometry drifts steadily, by 1 degree in total, and 5 cm at the centre of the
/// circle. Poses in `world` are those of odometry.
struct DriftingRobot {
  static constexpr RobotId kId = 1;
  static constexpr KeyframeIndex kKeyframes = 160, kStep = 4;
  static constexpr SeenBy kDrifts = {30, 60};

  SE3 drift = Eigen::Translation3d(2.04, 1.47, 1.0) *
              make_pose(so3_exp(Eigen::Vector3d(1, 2, 2) / 3.0 / kDegrees), {0, 0, 0}) *
              Eigen::Translation3d(-2.0, -1.5, -1.0);
  /// Standard deviations of a step of odometry. Over 65 steps, 16 mrad and 5 cm.
  double sigma_rad = 0.002, sigma_m = 0.006;

  static SE3 truth(KeyframeIndex k) {
    const double angle = 0.1 * k;
    return make_pose(so3_exp({0, 0, angle}), {2 + std::cos(angle), 1.5 + std::sin(angle), 1.0});
  }
  /// Motion of `world` by which the estimate of keyframe k errs.
  [[nodiscard]] SE3 error(KeyframeIndex k) const {
    if (k <= kDrifts[0]) return SE3::Identity();
    const double share =
        k < kDrifts[1] ? static_cast<double>(k - kDrifts[0]) / (kDrifts[1] - kDrifts[0]) : 1.0;
    return se3_exp(share * se3_log(drift));
  }
  [[nodiscard]] SE3 estimate(KeyframeIndex k) const { return error(k) * truth(k); }
  [[nodiscard]] Matrix6 step_covariance() const {
    Vector6 variances;
    variances << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
        Eigen::Vector3d::Constant(sigma_m * sigma_m);
    return variances.asDiagonal();
  }
  [[nodiscard]] std::vector<OdometryPose> odometry() const {
    std::vector<OdometryPose> keyframes;
    UncertainPose T_first_kf;
    for (KeyframeIndex k = 0; k < kKeyframes; ++k) {
      if (k > 0)
        T_first_kf =
            compose(T_first_kf, {estimate(k - 1).inverse() * estimate(k), step_covariance()});
      keyframes.push_back({{kId, k}, estimate(k), T_first_kf.Sigma});
    }
    return keyframes;
  }
};

/// Surface that the robot sees with these keyframes, where it really is.
struct SeenSurface {
  LabelledMesh mesh;
  SeenBy seen_by = {0, 0};
};

/// The chunks of all these surfaces, each mapped with the error of its first keyframe.
inline std::vector<MeshChunk> chunks_of(const DriftingRobot& robot,
                                        const std::vector<SeenSurface>& surfaces) {
  LabelledMesh mesh;
  MeshOrigin origin;
  for (KeyframeIndex k = 0; k < DriftingRobot::kKeyframes; ++k)
    origin.T_world_kf.push_back(robot.estimate(k));
  for (const SeenSurface& surface : surfaces) {
    LabelledMesh mapped = surface.mesh;
    mapped.transform(robot.error(surface.seen_by[0]));
    mesh.append(mapped);
    origin.seen_by.resize(mesh.vertices.size(), surface.seen_by);
  }
  origin.mapped = mesh.vertices;
  return split_mesh(mesh, DriftingRobot::kId, 0, {.cell_m = 1.0}, &origin).chunks;
}

}  // namespace km
