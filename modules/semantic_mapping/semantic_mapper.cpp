#include "modules/semantic_mapping/semantic_mapper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/data/measurement_limits.hpp"
#include "modules/mesh/coarse_view.hpp"
#include "modules/semantic_mapping/block_fusion.hpp"
#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/depth_view.hpp"

namespace km {
namespace {

// At most this many eighths of max_blocks remain at the end of a frame, so that there is room for
// the next one.
constexpr std::size_t kFullEighths = 7;

DepthNoise noise_of(const SemanticMappingConfig& config) {
  return {SemanticMappingConfig::kDepthSigma_m,
          config.depth_sigma_per_m.value_or(SemanticMappingConfig::kDepthSigma_per_m)};
}

// Bands of depths for voxels of voxel_size_m, twice and four times as large, and so on up to
// max_range_m. At the end of a band the truncation is two standard deviations. Bands overlap, so
// that their surfaces meet.
std::vector<DepthBand> bands_of(const SemanticMappingConfig& config) {
  constexpr double kOverlap = 0.1;
  const double per_m = std::max(noise_of(config).per_m, 1e-9);
  std::vector<DepthBand> bands;
  double from_m = 0.0;
  for (double voxel_m = *config.voxel_size_m;; voxel_m *= 2.0) {
    const double to_m =
        std::sqrt(SemanticMappingConfig::kTruncation_voxels * voxel_m / (2.0 * per_m));
    bands.push_back({from_m, to_m});
    if (to_m >= config.max_range_m) return bands;
    from_m = (1.0 - kOverlap) * to_m;
  }
}

SemanticMappingConfig complete(const SemanticMappingConfig& config) {
  if (!config.voxel_size_m) throw std::invalid_argument("mapping: no voxel_size_m");
  return checked(config);
}

template <typename Image, typename Pixels>
bool fits(const Image& image, const Pixels& pixels, const Camera& camera) {
  return image.width == camera.width && image.height == camera.height &&
         pixels.size() ==
             static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

}  // namespace

double fitting_voxel_m(const SemanticMappingConfig& config,
                       std::span<const std::shared_ptr<const DepthImage>> images) {
  constexpr std::array kSides_m = {0.02, 0.03, 0.05, 0.1};
  constexpr std::array kNearest_m = {1.48, 2.22, 3.15};  // lower quartile up to which a side fits
  std::vector<std::uint16_t> known;
  for (const auto& image : images)
    for (const std::uint16_t mm : image->millimetres)
      if (mm >= 1e3 * config.min_range_m && mm <= 1e3 * config.max_range_m) known.push_back(mm);
  if (known.empty()) return kSides_m.back();
  const auto quartile = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 4);
  std::ranges::nth_element(known, quartile);
  const auto found = std::ranges::lower_bound(kNearest_m, 1e-3 * *quartile);
  return kSides_m.at(static_cast<std::size_t>(found - kNearest_m.begin()));
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
      : config(complete(settings)),
        camera(its_camera),
        views(camera, config.min_range_m, config.max_range_m, palette),
        coarse_views(camera, noise_of(config), config.min_range_m),
        bands(bands_of(config)) {
    for (std::size_t level = 0; level < bands.size(); ++level) {
      const double voxel_m = std::ldexp(*config.voxel_size_m, static_cast<int>(level));
      maps.emplace_back(voxel_m, known_from(config, voxel_m));
    }
  }

  void integrate(std::size_t level, const DepthView& view, const BlockFusion& fusion,
                 const SE3& T_odom_cam, IntegrationReport& report);
  std::vector<Update> select(std::size_t level, const DepthView& view, const BlockFusion& fusion,
                             const SE3& T_odom_cam, IntegrationReport& report);
  static void fuse(const BlockFusion& fusion, const std::vector<Update>& updates);
  void remove_empty(std::size_t level, const BlockFusion& fusion,
                    const std::vector<Update>& updates);
  void leave_window();
  void make_room();
  void finalise(std::size_t level, const std::vector<VoxelBlock*>& blocks);
  void note_finer(std::size_t level, const VoxelBlock& block);
  [[nodiscard]] std::span<const BlockMap> finer_than(std::size_t level) const {
    return std::span(maps).first(level);
  }
  [[nodiscard]] std::size_t block_count() const;

  SemanticMappingConfig config;
  Camera camera;
  DepthViewMaker views;
  CoarseViews coarse_views;
  std::vector<DepthBand> bands;
  std::vector<BlockMap> maps;  // by band, with voxels of double size from one to the next
  IncrementalMesh mesh;
  std::size_t unreported = 0;  // number of blocks that were meshed since update_mesh()
  std::uint64_t frame = 0;
  KeyframeIndex keyframe = 0;
  std::optional<Eigen::Vector3d> camera_at;  // last position
  double way_m = 0.0;                        // distance travelled by the camera
  bool labelled = false, coloured = false;
  std::size_t dropped_faces = 0;
};

std::size_t SemanticMapper::State::block_count() const {
  std::size_t count = 0;
  for (const BlockMap& map : maps) count += map.size();
  return count;
}

void SemanticMapper::State::integrate(std::size_t level, const DepthView& view,
                                      const BlockFusion& fusion, const SE3& T_odom_cam,
                                      IntegrationReport& report) {
  const auto updates = select(level, view, fusion, T_odom_cam, report);
  fuse(fusion, updates);
  remove_empty(level, fusion, updates);
}

std::vector<SemanticMapper::State::Update> SemanticMapper::State::select(
    std::size_t level, const DepthView& view, const BlockFusion& fusion, const SE3& T_odom_cam,
    IntegrationReport& report) {
  std::vector<Update> updates;
  BlockMap& map = maps[level];
  const std::size_t others = block_count() - map.size();
  const NearBlocks near = select_near_blocks(
      view, T_odom_cam, bands[level],
      std::max(static_cast<std::size_t>(config.max_blocks), others) - others, frame, keyframe, map);
  report.blocks_refused += near.refused;
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

void SemanticMapper::State::remove_empty(std::size_t level, const BlockFusion& fusion,
                                         const std::vector<Update>& updates) {
  for (const Update& update : updates) {
    if (update.near || !fusion.is_empty(*update.block)) continue;
    mesh.forget(*update.block, maps[level], keyframe);
    maps[level].erase(Eigen::Vector3i(update.block->position));
  }
}

// The larger voxels at the same points remember that smaller ones knew them.
void SemanticMapper::State::note_finer(std::size_t level, const VoxelBlock& block) {
  for (std::size_t coarser = level + 1; coarser < maps.size(); ++coarser) {
    const int scale = 1 << (coarser - level);
    const auto is_common = [&](int c) { return (c & (scale - 1)) == 0; };
    for (int z = 0; z < kBlockSide; ++z)
      for (int y = 0; y < kBlockSide; ++y)
        for (int x = 0; x < kBlockSide; ++x) {
          const Eigen::Vector3i at = kBlockSide * block.position + Eigen::Vector3i(x, y, z);
          if (!is_common(at.x()) || !is_common(at.y()) || !is_common(at.z()) ||
              !maps[level].knows(block, voxel_index(x, y, z)))
            continue;
          const Eigen::Vector3i voxel = at / scale;
          const Eigen::Vector3i inside =
              voxel.unaryExpr([](int c) { return c & (kBlockSide - 1); });
          VoxelBlock* larger = maps[coarser].find((voxel - inside) / kBlockSide);
          if (larger == nullptr) continue;
          const auto row = static_cast<std::size_t>(inside.y() + kBlockSide * inside.z());
          larger->finer_rows[row] =
              static_cast<std::uint8_t>(larger->finer_rows[row] | 1 << inside.x());
        }
  }
}

void SemanticMapper::State::finalise(std::size_t level, const std::vector<VoxelBlock*>& blocks) {
  unreported += mesh.finalise(blocks, maps[level], finer_than(level));
  for (VoxelBlock* block : blocks) {
    note_finer(level, *block);
    maps[level].erase(Eigen::Vector3i(block->position));
  }
}

// From the largest voxels on: their last mesh depends on smaller ones.
void SemanticMapper::State::leave_window() {
  for (std::size_t level = maps.size(); level-- > 0;) {
    std::vector<VoxelBlock*> old;
    for (const auto& block : maps[level].blocks())
      if (way_m - block->last_seen_m > config.window_m) old.push_back(block.get());
    if (!old.empty()) finalise(level, old);
  }
}

void SemanticMapper::State::make_room() {
  const std::size_t most = static_cast<std::size_t>(config.max_blocks) * kFullEighths / 8;
  for (std::size_t level = maps.size(); level-- > 0 && block_count() > most;) {
    std::vector<VoxelBlock*> others;  // blocks not selected for this frame
    for (const auto& block : maps[level].blocks())
      if (block->selected_in != frame) others.push_back(block.get());
    std::stable_sort(others.begin(), others.end(), [](const VoxelBlock* a, const VoxelBlock* b) {
      return a->last_seen != b->last_seen ? a->last_seen < b->last_seen
                                          : a->selected_in < b->selected_in;
    });
    others.resize(std::min(others.size(), block_count() - most));
    finalise(level, others);
  }
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
  if (!is_rigid(T_odom_cam, kUnitTolerance)) {
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

  const float gain = exposure_gain(view, T_odom_cam, state.maps);
  for (std::size_t level = 0; level < state.maps.size(); ++level) {
    const BlockFusion fusion(state.config, state.maps[level].voxel_m(), view, T_odom_cam, keyframe,
                             gain);
    state.integrate(level, view, fusion, T_odom_cam, report);
  }
  if (new_keyframe) state.leave_window();
  state.make_room();
  return report;
}

std::size_t SemanticMapper::update_mesh() {
  std::size_t meshed = std::exchange(state_->unreported, 0);
  for (std::size_t level = 0; level < state_->maps.size(); ++level)
    meshed += state_->mesh.update(state_->maps[level], state_->finer_than(level));
  return meshed;
}

SurfaceDrop SemanticMapper::drop(const SupersededSurface& superseded) {
  const SurfaceDrop dropped = state_->mesh.drop(superseded);
  state_->dropped_faces += dropped.faces;
  return dropped;
}

MapMesh SemanticMapper::mesh() const {
  MapMesh map = state_->mesh.snapshot(state_->maps, state_->labelled, state_->coloured);
  map.views = state_->coarse_views.views();
  return map;
}

MapSize SemanticMapper::size() const {
  return {state_->block_count(), state_->mesh.vertex_count(), state_->mesh.face_count(),
          state_->mesh.final_face_count(), state_->dropped_faces};
}

}  // namespace km
