#include "modules/mesh_deformation/mesh_corrector.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "modules/mesh/seen_through.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "modules/mesh_deformation/superseded_surface.hpp"

namespace km {
namespace {

template <typename T>
std::vector<T> elements_of(std::vector<T> values, const std::vector<std::uint32_t>& kept) {
  keep_elements(values, kept);
  return values;
}

// Number of faces of a map that stay after its mapper has dropped surface.
std::size_t faces_after(const MapMesh& map, const SupersededSurface& dropped) {
  std::vector<bool> is_listed(map.ids.size(), false);
  auto listed = dropped.vertices.begin();
  for (std::size_t v = 0; v < map.ids.size() && listed != dropped.vertices.end(); ++v)
    if (map.ids[v] == listed->id) {
      is_listed[v] = true;
      ++listed;
    }
  return static_cast<std::size_t>(
      std::ranges::count_if(map.mesh.faces, [&](const LabelledMesh::Face& face) {
        return !is_listed[face[0]] || !is_listed[face[1]] || !is_listed[face[2]];
      }));
}

}  // namespace

MeshCorrector::MeshCorrector(const MeshDeformationConfig& config, const CopyLimits& limits)
    : limits_(limits),
      duplicate_faces_(static_cast<std::size_t>(config.duplicate_faces)),
      max_gap_keyframes_(static_cast<KeyframeIndex>(config.time_window_keyframes)),
      seen_through_views_(config.seen_through_views),
      optimizer_(config) {}

std::optional<MeshCorrection> MeshCorrector::correct(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  std::vector<SE3> anchors = complete(input.T_odom_kf, input.T_world_kf);
  if (input.map_version != map_version_) return deform(input, std::move(anchors));
  const KeyframeMotion motion = keyframe_motion(origin_.T_world_kf, anchors, {});
  if (motion.non_rigid > 1.0) return deform(input, std::move(anchors));
  if (largest_difference(origin_.T_world_kf, motion.T_after_before, T_result_optimized_, {}) <= 1.0)
    return std::nullopt;
  T_result_optimized_ = motion.T_after_before;
  MeshCorrection result{optimized_, report_, false, {}, 0, 0, origin_};
  result.mesh.transform(T_result_optimized_);
  for (SE3& pose : result.origin.T_world_kf) pose = T_result_optimized_ * pose;
  return result;
}

MeshCorrection MeshCorrector::correct_from_scratch(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  optimizer_.reset();
  distinct_faces_ = 0;
  gone_.clear();
  return deform(input, complete(input.T_odom_kf, input.T_world_kf));
}

// For each vertex of optimized_, which are those of the map, whether later views saw through it.
std::vector<bool> MeshCorrector::seen_through(const CorrectionInput& input) const {
  const std::vector<Eigen::Vector3f>& vertices = optimized_.vertices;
  const std::size_t known = std::min(input.covariances.size(), origin_.T_world_kf.size());
  if (seen_through_views_ == 0 || known == 0 || input.map.voxel_m <= 0.0)
    return std::vector(vertices.size(), false);
  std::vector<SightPoint> points;
  points.reserve(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const KeyframeIndex last = input.map.seen_by[v][1];
    points.push_back({vertices[v], last, last});
  }
  SightVotes votes(points, input.map.voxel_m);
  std::size_t keyframe = known;
  std::vector<PoseSigma> sigmas;
  for (const auto& view : input.map.views) {
    if (view->keyframe >= known) break;
    if (std::exchange(keyframe, view->keyframe) != view->keyframe)
      sigmas = relative_sigmas(input.covariances.first(known), keyframe);
    const SE3 T_world_odom = origin_.T_world_kf[keyframe] * input.T_odom_kf[keyframe].inverse();
    votes.add(*view, T_world_odom * view->T_odom_cam, view->keyframe, sigmas);
  }
  return votes.seen_through(seen_through_views_);
}

// True if a search for copies is due. It takes long, and follows the growth of the mesh. All
// vertices stay if the limits keep all copies, or if the map has an unknown voxel size or no ids,
// by which the mapper drops vertices.
bool MeshCorrector::has_many_copies(const MapMesh& map) const {
  const std::size_t faces = map.mesh.faces.size();
  return limits_.voxels > 0.0 && map.voxel_m > 0.0 && !map.ids.empty() &&
         faces > duplicate_faces_ &&
         static_cast<double>(faces) > (1.0 + limits_.share) * static_cast<double>(distinct_faces_);
}

// Replacements of the copies in optimized_, whose vertices are those `kept` of the map.
std::vector<std::uint32_t> MeshCorrector::copies_in(const MapMesh& map,
                                                    const std::vector<std::uint32_t>& kept) const {
  constexpr double kLongestEdge_voxels = 2.0;  // sqrt(3), plus the deformation
  return find_replacements(optimized_,
                           {elements_of(map.seen_by, kept), elements_of(map.certainty, kept)},
                           {limits_.voxels * map.voxel_m, kLongestEdge_voxels * map.voxel_m,
                            max_gap_keyframes_, limits_.copies});
}

// Surface that the mapper may drop: copies, and surface that is gone now and was gone at the last
// search.
SupersededSurface MeshCorrector::droppable(const MapMesh& map,
                                           const std::vector<std::uint32_t>& kept,
                                           std::span<const std::uint32_t> replacements) {
  const std::vector<std::uint64_t> ids = elements_of(map.ids, kept);
  SupersededSurface surface = named(replacements, ids);
  std::vector<std::uint64_t> gone;
  std::ranges::set_difference(map.ids, ids, std::back_inserter(gone));
  for (const std::uint64_t id : gone)
    if (std::ranges::binary_search(gone_, id)) surface.vertices.push_back({id, id});
  std::ranges::sort(surface.vertices, {}, &SupersededVertex::id);
  gone_ = std::move(gone);
  return surface;
}

MeshCorrection MeshCorrector::deform(const CorrectionInput& input, std::vector<SE3> anchors) {
  const MapMesh& map = input.map;
  DeformedMesh deformed = optimizer_.optimize(map, input.T_odom_kf, input.T_world_kf);
  map_version_ = input.map_version;
  origin_.T_world_kf = std::move(anchors);
  optimized_ = std::move(deformed.mesh);
  report_ = deformed.report;
  T_result_optimized_ = SE3::Identity();
  const std::size_t all = optimized_.faces.size();
  std::vector<std::uint32_t> kept = remove_seen_through(optimized_, seen_through(input));
  const std::size_t present = optimized_.faces.size();
  SupersededSurface dropped;
  if (has_many_copies(map)) {
    const std::vector<std::uint32_t> replacements = copies_in(map, kept);
    dropped = droppable(map, kept, replacements);
    distinct_faces_ = faces_after(map, dropped);
    if (has_many_copies(map)) {
      keep_elements(kept, remaining_vertices(optimized_, replacements));
      optimized_ = without_superseded(optimized_, replacements);
    } else {
      dropped = {};
    }
  }
  origin_.seen_by = elements_of(map.seen_by, kept);
  origin_.mapped = elements_of(map.mesh.vertices, kept);
  origin_.voxel_m = map.voxel_m;
  origin_.levels = elements_of(map.levels, kept);
  const std::size_t superseded = present - optimized_.faces.size();
  return {optimized_, report_, true, std::move(dropped), superseded, all - present, origin_};
}

}  // namespace km
