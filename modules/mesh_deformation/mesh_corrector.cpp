#include "modules/mesh_deformation/mesh_corrector.hpp"

#include <utility>

#include "modules/mesh_deformation/map_mesh_check.hpp"

namespace km {

MeshCorrector::MeshCorrector(const MeshDeformationConfig& config)
    : scale_{config.min_move_m, config.min_rotation_rad}, optimizer_(config) {}

std::optional<MeshCorrection> MeshCorrector::correct(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  std::vector<SE3> anchors = complete(input.T_odom_kf, input.T_world_kf);
  if (input.map_version != map_version_) return deform(input, std::move(anchors));
  const KeyframeMotion motion = keyframe_motion(anchors_, anchors, scale_);
  if (motion.bending > 1.0) return deform(input, std::move(anchors));
  if (largest_difference(anchors_, motion.T_after_before, T_published_optimized_, scale_) <= 1.0)
    return std::nullopt;
  T_published_optimized_ = motion.T_after_before;
  MeshCorrection result{input.map.mesh, report_, false};
  result.mesh.vertices = optimized_vertices_;
  result.mesh.transform(T_published_optimized_);
  return result;
}

MeshCorrection MeshCorrector::correct_afresh(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  optimizer_.reset();
  return deform(input, complete(input.T_odom_kf, input.T_world_kf));
}

MeshCorrection MeshCorrector::deform(const CorrectionInput& input, std::vector<SE3> anchors) {
  DeformedMesh deformed = optimizer_.optimize(input.map, input.T_odom_kf, input.T_world_kf);
  map_version_ = input.map_version;
  anchors_ = std::move(anchors);
  optimized_vertices_ = deformed.mesh.vertices;
  report_ = deformed.report;
  T_published_optimized_ = SE3::Identity();
  return {std::move(deformed.mesh), report_, true};
}

}  // namespace km
