#include "modules/mesh_deformation/mesh_corrector.hpp"

#include <algorithm>
#include <utility>

#include "modules/mesh/seen_through.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "modules/mesh_deformation/superseded_surface.hpp"

namespace km {

MeshCorrector::MeshCorrector(const MeshDeformationConfig& config)
    : duplicate_voxels_(config.duplicate_voxels),
      duplicate_faces_(static_cast<std::size_t>(config.duplicate_faces)),
      max_gap_keyframes_(static_cast<KeyframeIndex>(config.time_window_keyframes)),
      seen_through_views_(config.seen_through_views),
      scale_{config.min_move_m, config.min_rotation_rad},
      optimizer_(config) {}

std::optional<MeshCorrection> MeshCorrector::correct(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  std::vector<SE3> anchors = complete(input.T_odom_kf, input.T_world_kf);
  if (input.map_version != map_version_) return deform(input, std::move(anchors));
  const KeyframeMotion motion = keyframe_motion(anchors_, anchors, scale_);
  if (motion.non_rigid > 1.0) return deform(input, std::move(anchors));
  if (largest_difference(anchors_, motion.T_after_before, T_result_optimized_, scale_) <= 1.0)
    return std::nullopt;
  T_result_optimized_ = motion.T_after_before;
  MeshCorrection result{optimized_, report_, false, {}, 0, 0, {seen_by_, anchors_, mapped_}};
  result.mesh.transform(T_result_optimized_);
  for (SE3& pose : result.origin.T_world_kf) pose = T_result_optimized_ * pose;
  return result;
}

MeshCorrection MeshCorrector::correct_from_scratch(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  optimizer_.reset();
  return deform(input, complete(input.T_odom_kf, input.T_world_kf));
}

// Replacements of duplicate surface. All vertices stay if the config keeps all copies, or if the
// map has an unknown voxel size or no ids, by which the mapper drops vertices.
std::vector<std::uint32_t> MeshCorrector::replacements_in(const LabelledMesh& mesh,
                                                          const MapMesh& map) const {
  constexpr double kLongestEdge_voxels = 2.0;  // sqrt(3), plus the deformation
  if (duplicate_voxels_ <= 0.0 || mesh.faces.size() <= duplicate_faces_ || map.voxel_m <= 0.0 ||
      map.ids.empty())
    return std::vector(mesh.vertices.size(), kNoIndex);
  return find_replacements(
      mesh, {map.seen_by, map.certainty},
      {duplicate_voxels_ * map.voxel_m, kLongestEdge_voxels * map.voxel_m, max_gap_keyframes_});
}

// Removes surface that later views saw through from optimized_, and returns the number of faces.
std::size_t MeshCorrector::remove_gone(const CorrectionInput& input) {
  const std::size_t known = std::min(input.covariances.size(), anchors_.size());
  if (seen_through_views_ == 0 || known == 0 || input.map.voxel_m <= 0.0) return 0;
  std::vector<SightPoint> points;
  points.reserve(seen_by_.size());
  for (std::size_t v = 0; v < seen_by_.size(); ++v)
    points.push_back({optimized_.vertices[v], seen_by_[v][1], seen_by_[v][1]});
  SightVotes votes(points, input.map.voxel_m);
  std::size_t keyframe = known;
  std::vector<PoseSigma> sigmas;
  for (const auto& view : input.map.views) {
    if (view->keyframe >= known) break;
    if (std::exchange(keyframe, view->keyframe) != view->keyframe)
      sigmas = relative_sigmas(input.covariances.first(known), keyframe);
    const SE3 T_world_odom = anchors_[keyframe] * input.T_odom_kf[keyframe].inverse();
    votes.add(*view, T_world_odom * view->T_odom_cam, view->keyframe, sigmas);
  }
  const std::size_t before = optimized_.faces.size();
  const std::vector<std::uint32_t> kept =
      remove_seen_through(optimized_, votes.seen_through(seen_through_views_));
  keep_elements(seen_by_, kept);
  keep_elements(mapped_, kept);
  return before - optimized_.faces.size();
}

MeshCorrection MeshCorrector::deform(const CorrectionInput& input, std::vector<SE3> anchors) {
  const DeformedMesh deformed = optimizer_.optimize(input.map, input.T_odom_kf, input.T_world_kf);
  const std::vector<std::uint32_t> replacements = replacements_in(deformed.mesh, input.map);
  map_version_ = input.map_version;
  anchors_ = std::move(anchors);
  optimized_ = without_superseded(deformed.mesh, replacements);
  seen_by_ = input.map.seen_by;
  mapped_ = input.map.mesh.vertices;
  const std::vector<std::uint32_t> remaining = remaining_vertices(deformed.mesh, replacements);
  keep_elements(seen_by_, remaining);
  keep_elements(mapped_, remaining);
  const std::size_t superseded = deformed.mesh.faces.size() - optimized_.faces.size();
  const std::size_t gone = remove_gone(input);
  report_ = deformed.report;
  T_result_optimized_ = SE3::Identity();
  return {optimized_,
          report_,
          true,
          named(replacements, input.map.ids),
          superseded,
          gone,
          {seen_by_, anchors_, mapped_}};
}

}  // namespace km
