#include "modules/semantic_mapping/semantic_mapper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "modules/mesh/coarse_view.hpp"
#include "modules/semantic_mapping/block_fusion.hpp"
#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/depth_view.hpp"
#include "modules/semantic_mapping/space_tracker.hpp"

namespace km {
namespace {

// At most this many eighths of max_blocks remain at the end of a frame, so that there is room for
// the next one.
constexpr std::size_t kFullEighths = 7;

DepthNoise noise_of(const SemanticMappingConfig& config) {
  return {SemanticMappingConfig::kDepthSigma_m,
          config.depth_sigma_per_m.value_or(SemanticMappingConfig::kDepthSigma_per_m)};
}

bool usable(const SE3& T) {
  constexpr double kTolerance = 1e-3;
  const Eigen::Matrix3d R = T.linear();
  return T.matrix().allFinite() &&
         (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < kTolerance &&
         R.determinant() > 0.0;
}

template <typename Image, typename Pixels>
bool fits(const Image& image, const Pixels& pixels, const Camera& camera) {
  return image.width == camera.width && image.height == camera.height &&
         pixels.size() ==
             static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

}  // namespace

double fitting_voxel_m(const SemanticMappingConfig& config, const DepthImage& depth) {
  constexpr std::array kSides_m = {0.02, 0.03, 0.05, 0.1};
  std::vector<std::uint16_t> known;
  for (const std::uint16_t mm : depth.millimetres)
    if (mm >= 1e3 * config.min_range_m && mm <= 1e3 * config.max_range_m) known.push_back(mm);
  if (known.empty()) return kSides_m.back();
  const auto quartile = known.begin() + static_cast<std::ptrdiff_t>(known.size() * 3 / 4);
  std::ranges::nth_element(known, quartile);
  const double depth_m = 1e-3 * *quartile;
  const DepthNoise noise = noise_of(config);
  const double wanted_m =
      std::max(depth_m / 130.0, 0.2 * std::hypot(noise.base_m, noise.per_m * depth_m * depth_m));
  const auto found = std::ranges::lower_bound(kSides_m, wanted_m);
  return found == kSides_m.end() ? kSides_m.back() : *found;
}

struct SemanticMapper::State {
  // A block in view and the kind of its update.
  struct Update {
    VoxelBlock* block = nullptr;
    bool near = false;  // surface within kNearVoxels of the block
    bool free = false;  // whole block in free space (Relation::kFree)
  };

  State(const SemanticMappingConfig& settings, const Camera& its_camera,
        const LabelPalette& palette)
      : config(checked(settings)),
        camera(its_camera),
        views(camera, config.min_range_m, config.max_range_m, palette),
        coarse_views(camera, noise_of(config), config.min_range_m),
        mesh(config.voxel_m(), known_from(config)) {}

  std::vector<Update> select(const DepthView& view, const BlockFusion& fusion,
                             const SE3& T_odom_cam, IntegrationReport& report);
  static void fuse(const BlockFusion& fusion, const std::vector<Update>& updates);
  void remove_empty(const BlockFusion& fusion, const std::vector<Update>& updates);
  void leave_window();
  void make_room();
  void finalise(const std::vector<VoxelBlock*>& blocks);

  SemanticMappingConfig config;
  Camera camera;
  DepthViewMaker views;
  CoarseViews coarse_views;
  BlockMap map;
  IncrementalMesh mesh;
  std::size_t unreported = 0;  // number of blocks that were meshed since update_mesh()
  std::uint64_t frame = 0;
  KeyframeIndex keyframe = 0;
  std::optional<Eigen::Vector3d> camera_at;  // last position
  double way_m = 0.0;                        // distance travelled by the camera
  std::optional<SpaceTracker> space;
  bool labelled = false, coloured = false;
  std::size_t dropped_faces = 0;
};

std::vector<SemanticMapper::State::Update> SemanticMapper::State::select(
    const DepthView& view, const BlockFusion& fusion, const SE3& T_odom_cam,
    IntegrationReport& report) {
  std::vector<Update> updates;
  const NearBlocks near =
      select_near_blocks(view, T_odom_cam, config.voxel_m(),
                         static_cast<std::size_t>(config.max_blocks), frame, keyframe, map);
  report.blocks_refused = near.refused;
  for (VoxelBlock* block : near.blocks) {
    if (view.labelled && block->labels == nullptr)
      block->labels = std::make_unique<std::array<VoxelLabels, kBlockVoxels>>();
    if (!view.colors.empty() && block->colors == nullptr)
      block->colors = std::make_unique<std::array<VoxelColor, kBlockVoxels>>();
    block->last_seen_m = way_m;
    updates.push_back({block, true, false});
  }
  for (const auto& block : map.blocks()) {
    if (block->selected_in == frame) continue;
    const BlockFusion::Relation relation = fusion.relation_to(*block);
    if (relation == BlockFusion::Relation::kNotSeen) continue;
    updates.push_back({block.get(), false, relation == BlockFusion::Relation::kFree});
  }
  return updates;
}

void SemanticMapper::State::fuse(const BlockFusion& fusion, const std::vector<Update>& updates) {
  cv::parallel_for_(cv::Range(0, static_cast<int>(updates.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const Update& update = updates[static_cast<std::size_t>(i)];
      if (update.free) {
        fusion.fuse_free(*update.block);
      } else {
        fusion.fuse(*update.block);
      }
    }
  });
}

void SemanticMapper::State::remove_empty(const BlockFusion& fusion,
                                         const std::vector<Update>& updates) {
  for (const Update& update : updates) {
    if (update.near || !fusion.is_empty(*update.block)) continue;
    mesh.forget(*update.block, map, keyframe);
    if (space) space->note_empty(update.block->position, way_m);
    map.erase(Eigen::Vector3i(update.block->position));
  }
}

void SemanticMapper::State::finalise(const std::vector<VoxelBlock*>& blocks) {
  unreported += mesh.finalise(blocks, map);
  for (VoxelBlock* block : blocks) {
    if (space) space->note_left(block->position);
    map.erase(Eigen::Vector3i(block->position));
  }
}

void SemanticMapper::State::leave_window() {
  std::vector<VoxelBlock*> old;
  for (const auto& block : map.blocks())
    if (way_m - block->last_seen_m > config.window_m) old.push_back(block.get());
  if (!old.empty()) finalise(old);
}

void SemanticMapper::State::make_room() {
  const std::size_t most = static_cast<std::size_t>(config.max_blocks) * kFullEighths / 8;
  if (map.size() <= most) return;
  std::vector<VoxelBlock*> others;  // blocks not selected for this frame
  for (const auto& block : map.blocks())
    if (block->selected_in != frame) others.push_back(block.get());
  std::stable_sort(others.begin(), others.end(), [](const VoxelBlock* a, const VoxelBlock* b) {
    return a->last_seen != b->last_seen ? a->last_seen < b->last_seen
                                        : a->selected_in < b->selected_in;
  });
  others.resize(std::min(others.size(), map.size() - most));
  finalise(others);
}

SemanticMapper::SemanticMapper(const SemanticMappingConfig& config, const Camera& camera,
                               const LabelPalette& palette)
    : state_(std::make_unique<State>(config, camera, palette)) {}
SemanticMapper::~SemanticMapper() = default;
SemanticMapper::SemanticMapper(SemanticMapper&&) noexcept = default;
SemanticMapper& SemanticMapper::operator=(SemanticMapper&&) noexcept = default;

IntegrationReport SemanticMapper::integrate(const DepthImage& depth, const LabelImage* labels,
                                            const SE3& T_odom_cam, KeyframeIndex keyframe,
                                            const ColorImage* color) {
  State& state = *state_;
  if (keyframe < state.keyframe)
    throw std::invalid_argument("mapping: keyframe " + std::to_string(keyframe) + " after " +
                                std::to_string(state.keyframe));
  IntegrationReport report;
  if (!fits(depth, depth.millimetres, state.camera)) {
    report.status = IntegrationStatus::kDepthSizeDiffers;
    return report;
  }
  if (!usable(T_odom_cam)) {
    report.status = IntegrationStatus::kPoseUnusable;
    return report;
  }
  report.label_size_differs = labels != nullptr && !fits(*labels, labels->ids, state.camera);
  if (report.label_size_differs) labels = nullptr;
  if (color != nullptr && !fits(*color, color->pixels, state.camera)) color = nullptr;

  const bool new_keyframe = keyframe != state.keyframe;
  state.keyframe = keyframe;
  state.labelled |= labels != nullptr;
  state.coloured |= color != nullptr;
  ++state.frame;
  state.way_m +=
      (T_odom_cam.translation() - state.camera_at.value_or(T_odom_cam.translation())).norm();
  state.camera_at = T_odom_cam.translation();
  const DepthView& view = state.views.make(depth, labels, color);
  state.coarse_views.add(depth, T_odom_cam, keyframe);
  report.off_palette_pixels = view.off_palette_pixels;

  const float gain = exposure_gain(view, T_odom_cam, state.config.voxel_m(), state.map);
  const BlockFusion fusion(state.config, view, T_odom_cam, keyframe, gain);
  const auto updates = state.select(view, fusion, T_odom_cam, report);
  State::fuse(fusion, updates);
  if (state.space) {
    for (const State::Update& update : updates) state.space->note(update.block->position);
    if (new_keyframe || state.frame == 1)
      state.space->see_free(view, fusion, T_odom_cam, state.map, state.way_m);
  }
  state.remove_empty(fusion, updates);
  if (new_keyframe) state.leave_window();
  state.make_room();
  return report;
}

std::size_t SemanticMapper::update_mesh() {
  return state_->mesh.update(state_->map) + std::exchange(state_->unreported, 0);
}

SurfaceDrop SemanticMapper::drop(const SupersededSurface& superseded) {
  const SurfaceDrop dropped = state_->mesh.drop(superseded);
  state_->dropped_faces += dropped.faces;
  return dropped;
}

void SemanticMapper::track_space(bool is_wanted) {
  state_->space.reset();
  if (!is_wanted) return;
  state_->space.emplace(state_->config);
  for (const auto& block : state_->map.blocks()) state_->space->note(block->position);
}

SpaceChanges SemanticMapper::take_space_changes() {
  return state_->space->take(state_->map);
}

MapMesh SemanticMapper::mesh() const {
  MapMesh map = state_->mesh.snapshot(state_->map, state_->labelled, state_->coloured);
  map.views = state_->coarse_views.views();
  return map;
}

MapSize SemanticMapper::size() const {
  return {state_->map.size(), state_->mesh.vertex_count(), state_->mesh.face_count(),
          state_->mesh.final_face_count(), state_->dropped_faces};
}

}  // namespace km
