#include "modules/mesh_deformation/mesh_corrector.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "modules/mesh/seen_through.hpp"
#include "modules/mesh_deformation/superseded_surface.hpp"

namespace km {
namespace {

template <typename T>
std::vector<T> elements_of(std::vector<T> values, const std::vector<std::uint32_t>& kept) {
  keep_elements(values, kept);
  return values;
}

// True if a keyframe has moved so far that the mesh is corrected. New keyframes do not count.
bool has_moved(const std::vector<SE3>& before, const std::vector<SE3>& after) {
  constexpr double kTranslation_m = 0.01, kRotation_rad = 0.005;
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i)
    if ((after[i].translation() - before[i].translation()).norm() > kTranslation_m ||
        angle_of(before[i].linear().transpose() * after[i].linear()) > kRotation_rad)
      return true;
  return false;
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
    : config_(checked(config)), limits_(limits) {}

std::optional<MeshCorrection> MeshCorrector::correct(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  std::vector<SE3> anchors = complete(input.T_odom_kf, input.T_world_kf);
  if (input.map_version == map_version_ && !has_moved(anchors_, anchors)) return std::nullopt;
  return deform(input, std::move(anchors));
}

MeshCorrection MeshCorrector::correct_from_scratch(const CorrectionInput& input) {
  check_trajectories(input.T_odom_kf, input.T_world_kf);
  distinct_faces_ = 0;
  gone_.clear();
  return deform(input, complete(input.T_odom_kf, input.T_world_kf));
}

// For each corrected vertex of the map, whether later views saw through it.
std::vector<bool> MeshCorrector::seen_through(const CorrectionInput& input,
                                              const std::vector<Eigen::Vector3f>& vertices) const {
  const std::size_t known = std::min(input.covariances.size(), anchors_.size());
  if (config_.seen_through_views == 0 || known == 0 || input.map.voxel_m <= 0.0)
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
    const SE3 T_world_odom = anchors_[keyframe] * input.T_odom_kf[keyframe].inverse();
    votes.add(*view, T_world_odom * view->T_odom_cam, view->keyframe, sigmas);
  }
  return votes.seen_through(config_.seen_through_views);
}

// True if a search for copies is due. It takes long, and follows the growth of the mesh. All
// vertices stay if the limits keep all copies, or if the map has an unknown voxel size or no ids,
// by which the mapper drops vertices.
bool MeshCorrector::has_many_copies(const MapMesh& map) const {
  const std::size_t faces = map.mesh.faces.size();
  return limits_.voxels > 0.0 && map.voxel_m > 0.0 && !map.ids.empty() &&
         faces > static_cast<std::size_t>(config_.duplicate_faces) &&
         static_cast<double>(faces) > (1.0 + limits_.share) * static_cast<double>(distinct_faces_);
}

// Replacements of the copies in a corrected mesh, whose vertices are those `kept` of the map.
std::vector<std::uint32_t> MeshCorrector::copies_in(const LabelledMesh& mesh, const MapMesh& map,
                                                    const std::vector<std::uint32_t>& kept) const {
  constexpr double kLongestEdge_voxels = 2.0;  // sqrt(3), plus the deformation
  return find_replacements(
      mesh, {elements_of(map.seen_by, kept), elements_of(map.certainty, kept)},
      {limits_.voxels * map.voxel_m, kLongestEdge_voxels * map.voxel_m,
       static_cast<KeyframeIndex>(config_.time_window_keyframes), limits_.copies});
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
  DeformedMesh deformed = optimize_mesh(map, input.T_odom_kf, input.T_world_kf, config_);
  map_version_ = input.map_version;
  anchors_ = std::move(anchors);
  MeshCorrection result;
  result.mesh = std::move(deformed.mesh);
  result.report = deformed.report;
  LabelledMesh& mesh = result.mesh;
  const std::size_t all = mesh.faces.size();
  std::vector<std::uint32_t> kept = remove_seen_through(mesh, seen_through(input, mesh.vertices));
  const std::size_t present = mesh.faces.size();
  result.seen_through = all - present;
  if (has_many_copies(map)) {
    const std::vector<std::uint32_t> replacements = copies_in(mesh, map, kept);
    SupersededSurface dropped = droppable(map, kept, replacements);
    distinct_faces_ = faces_after(map, dropped);
    if (has_many_copies(map)) {
      keep_elements(kept, remaining_vertices(mesh, replacements));
      mesh = without_superseded(mesh, replacements);
      result.superseded = std::move(dropped);
    }
  }
  result.superseded_faces = present - mesh.faces.size();
  result.origin = {.seen_by = elements_of(map.seen_by, kept),
                   .T_world_kf = anchors_,
                   .mapped = elements_of(map.mesh.vertices, kept),
                   .voxel_m = map.voxel_m,
                   .levels = elements_of(map.levels, kept)};
  return result;
}

}  // namespace km
