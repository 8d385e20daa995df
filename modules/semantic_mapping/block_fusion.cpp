#include "modules/semantic_mapping/block_fusion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace km {
namespace {

// Distance between sampled pixels [px]: about one voxel at the greatest depth of the view, or
// `to_m`.
int stride_of(const DepthView& view, double voxel_size_m, double to_m) {
  constexpr int kLongest = 16;  // upper bound of the distance [px]
  const std::uint16_t farthest = *std::max_element(view.farthest.begin(), view.farthest.end());
  const float focal = std::max(view.fx, view.fy);
  const float depth_m = std::min(DepthView::depth_m(farthest), static_cast<float>(to_m));
  const float pixels = static_cast<float>(voxel_size_m) * focal / std::max(depth_m, 0.1F);
  return static_cast<int>(std::clamp(pixels, 1.0F, static_cast<float>(kLongest)));
}

// Largest integer not above the value, for values above -kOffset.
Eigen::Vector3i floor_of(const Eigen::Vector3f& value) {
  constexpr float kOffset = 4096.0F;
  return (value.array() + kOffset).cast<int>() - static_cast<int>(kOffset);
}

class Selector {
 public:
  Selector(std::size_t max_blocks, std::uint64_t frame, KeyframeIndex keyframe, BlockMap& map)
      : max_blocks_(max_blocks), frame_(frame), keyframe_(keyframe), map_(map) {}

  // Adds all blocks from `low` to `high`. Neighbouring samples mostly have the same ones.
  void add(const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
    if (low == low_ && high == high_) return;
    low_ = low;
    high_ = high;
    Eigen::Vector3i at;
    for (at.z() = low.z(); at.z() <= high.z(); ++at.z())
      for (at.y() = low.y(); at.y() <= high.y(); ++at.y())
        for (at.x() = low.x(); at.x() <= high.x(); ++at.x()) add(at);
  }

  NearBlocks result() { return std::move(result_); }

 private:
  void add(const Eigen::Vector3i& position) {
    VoxelBlock* block = map_.find(position);
    if (block == nullptr) {
      if (map_.size() >= max_blocks_ || !BlockMap::in_reach(position)) {
        ++result_.refused;
        return;
      }
      block = &map_.insert(position);
      block->last_seen = keyframe_;
    }
    if (block->selected_in == frame_) return;
    block->selected_in = frame_;
    result_.blocks.push_back(block);
  }

  std::size_t max_blocks_;
  std::uint64_t frame_;
  KeyframeIndex keyframe_;
  BlockMap& map_;
  NearBlocks result_;
  Eigen::Vector3i low_ = Eigen::Vector3i::Ones(), high_ = Eigen::Vector3i::Zero();
};

}  // namespace

NearBlocks select_near_blocks(const DepthView& view, const SE3& T_odom_cam, const DepthBand& band,
                              std::size_t max_blocks, std::uint64_t frame, KeyframeIndex keyframe,
                              BlockMap& map) {
  const double block_m = kBlockSide * map.voxel_m();
  const auto above_m = static_cast<float>(band.above_m), to_m = static_cast<float>(band.to_m);
  // Positions are in blocks, relative to the camera's block, so that float is precise enough at any
  // distance from the origin.
  const Eigen::Vector3d camera = T_odom_cam.translation() / block_m;
  const Eigen::Vector3d base = camera.array().floor();
  const Eigen::Vector3f origin = (camera - base).cast<float>();
  const Eigen::Vector3i base_block = base.cwiseMax(-1e9).cwiseMin(1e9).cast<int>();
  const Eigen::Matrix3f R = (T_odom_cam.linear() / block_m).cast<float>();
  constexpr float kReach = kNearVoxels / static_cast<float>(kBlockSide);

  Selector selector(max_blocks, frame, keyframe, map);
  const int stride = stride_of(view, map.voxel_m(), band.to_m);
  for (int v = stride / 2; v < view.height; v += stride) {
    const std::uint32_t* line =
        &view.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(view.width)];
    const float y = (static_cast<float>(v) - view.cy) / view.fy;
    const Eigen::Vector3f side = R.col(0) / view.fx;
    const Eigen::Vector3f start = y * R.col(1) + R.col(2) - view.cx * side;
    for (int u = stride / 2; u < view.width; u += stride) {
      const float depth = DepthView::depth_m(line[u]);
      if (depth <= above_m || depth > to_m) continue;
      const Eigen::Vector3f point = origin + depth * (start + static_cast<float>(u) * side);
      selector.add(base_block + floor_of(point.array() - kReach),
                   base_block + floor_of(point.array() + kReach));
    }
  }
  return selector.result();
}

float exposure_gain(const DepthView& view, const SE3& T_odom_cam, std::span<const BlockMap> maps) {
  constexpr int kStep_px = 12;
  constexpr std::size_t kLeastPixels = 50;
  constexpr int kDark = 30, kBright = 720;  // sums of three channels of usable pixels
  if (view.colors.empty()) return 1.0F;
  const auto sum_of = [](const ColorImage::Pixel& color) { return color[0] + color[1] + color[2]; };
  const auto color_at = [&](const Eigen::Vector3d& point) -> const VoxelColor* {
    for (const BlockMap& map : maps) {
      const Eigen::Vector3d at = point / map.voxel_m();
      if (!(at.cwiseAbs().maxCoeff() < 1e7)) continue;
      const Eigen::Vector3i voxel = at.array().round().cast<int>();
      const Eigen::Vector3i inside = voxel.unaryExpr([](int x) { return x & (kBlockSide - 1); });
      const VoxelBlock* block = map.find((voxel - inside) / kBlockSide);
      if (block == nullptr || block->colors == nullptr) continue;
      const VoxelColor& color = (*block->colors)[voxel_index(inside.x(), inside.y(), inside.z())];
      if (color.quality > 0) return &color;
    }
    return nullptr;
  };
  std::size_t count = 0;
  double of_map = 0.0, of_view = 0.0;
  for (int v = 0; v < view.height; v += kStep_px)
    for (int u = 0; u < view.width; u += kStep_px) {
      const std::size_t pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(view.width) +
                                static_cast<std::size_t>(u);
      const float depth = DepthView::depth_m(view.pixels[pixel]);
      const int seen = sum_of(view.colors[pixel]);
      if (depth <= 0.0F || seen < kDark || seen > kBright) continue;
      const Eigen::Vector3f ray((static_cast<float>(u) - view.cx) / view.fx,
                                (static_cast<float>(v) - view.cy) / view.fy, 1.0F);
      const VoxelColor* known = color_at(T_odom_cam * (depth * ray).cast<double>().eval());
      if (known == nullptr) continue;
      ++count;
      of_map += sum_of(known->color);
      of_view += seen;
    }
  if (count < kLeastPixels) return 1.0F;
  return static_cast<float>(std::clamp(of_map / of_view, 0.5, 2.0));
}

// Eight voxels along x. Plain loops over arrays, which the compiler vectorises.
struct BlockFusion::Row {
  alignas(32) std::array<float, kBlockSide> z;                // [m]
  alignas(32) std::array<std::int32_t, kBlockSide> index;     // in DepthView::pixels
  alignas(32) std::array<std::uint32_t, kBlockSide> pixel;    // value at `index`
  alignas(32) std::array<float, kBlockSide> observed_weight;  // 0: not observed
  bool moved = false;                                         // some distance has changed
  unsigned near_bits = 0;                                     // observed near the surface
};

BlockFusion::BlockFusion(const SemanticMappingConfig& config, double voxel_m, const DepthView& view,
                         const SE3& T_odom_cam, KeyframeIndex keyframe, float gain)
    : view_(view), keyframe_(keyframe), gain_(gain) {
  const SE3 T_cam_odom = T_odom_cam.inverse();
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  // Half a pixel is added, so that truncation rounds to the nearest pixel.
  K << static_cast<double>(view.fx), 0.0, static_cast<double>(view.cx) + 0.5,  //
      0.0, static_cast<double>(view.fy), static_cast<double>(view.cy) + 0.5,   //
      0.0, 0.0, 1.0;
  M_ = K * T_cam_odom.linear();
  offset_ = K * T_cam_odom.translation();
  step_ = (voxel_m * M_).cast<float>();
  block_m_ = kBlockSide * voxel_m;

  voxel_ = static_cast<float>(voxel_m);
  truncation_ = static_cast<float>(SemanticMappingConfig::kTruncation_voxels) * voxel_;
  near_ = kNearVoxels * voxel_;
  closest_ = 0.5F * static_cast<float>(std::max(config.min_range_m, 0.01));
  max_weight_ = static_cast<float>(SemanticMappingConfig::kMaxWeight);
  variance_ = static_cast<float>(SemanticMappingConfig::kDepthSigma_m *
                                 SemanticMappingConfig::kDepthSigma_m);
  const double sigma_per_m =
      config.depth_sigma_per_m.value_or(SemanticMappingConfig::kDepthSigma_per_m);
  quadratic_variance_ = static_cast<float>(sigma_per_m * sigma_per_m);
}

Eigen::Vector3f BlockFusion::corner_of(const VoxelBlock& block) const {
  return (M_ * (block_m_ * block.position.cast<double>()) + offset_).cast<float>();
}

float BlockFusion::weight_of(float depth) const {
  const float squared = depth * depth;
  return variance_ / (variance_ + quadratic_variance_ * squared * squared);
}

BlockFusion::Relation BlockFusion::relation_to(const VoxelBlock& block) const {
  const Eigen::Vector3f corner = corner_of(block);
  Eigen::Array2f low = Eigen::Array2f::Constant(std::numeric_limits<float>::max());
  Eigen::Array2f high = -low;
  float z_low = std::numeric_limits<float>::max(), z_high = -z_low;
  for (int i = 0; i < 8; ++i) {
    constexpr float kLast = kBlockSide - 1;
    const Eigen::Vector3f p =
        corner + step_ * Eigen::Vector3f((i & 1) != 0 ? kLast : 0.0F, (i & 2) != 0 ? kLast : 0.0F,
                                         (i & 4) != 0 ? kLast : 0.0F);
    z_low = std::min(z_low, p.z());
    z_high = std::max(z_high, p.z());
    const Eigen::Array2f px = p.head<2>().array() / std::max(p.z(), closest_);
    low = low.min(px);
    high = high.max(px);
  }
  if (z_high < closest_) return Relation::kNotSeen;
  const Eigen::Array2f size(static_cast<float>(view_.width), static_cast<float>(view_.height));
  if (z_low < closest_) return Relation::kMixed;  // beside the camera: its image is unbounded
  if ((high < 0.0F).any() || (low >= size).any()) return Relation::kNotSeen;

  const bool whole = (low >= 0.0F).all() && (high < size).all();
  constexpr float kTile = DepthView::kTileSide;
  const Eigen::Array2i first = (low.max(0.0F) / kTile).cast<int>();
  const Eigen::Array2i last = (high.min(size - 1.0F) / kTile).cast<int>();
  std::uint16_t nearest = std::numeric_limits<std::uint16_t>::max(), farthest = 0;
  for (int row = first.y(); row <= last.y(); ++row)
    for (int column = first.x(); column <= last.x(); ++column) {
      const auto tile = static_cast<std::size_t>(row * view_.tile_columns + column);
      nearest = std::min(nearest, view_.nearest[tile]);
      farthest = std::max(farthest, view_.farthest[tile]);
    }
  if (farthest == 0 || z_low >= DepthView::depth_m(farthest) + truncation_)
    return Relation::kNotSeen;
  return whole && z_high <= DepthView::depth_m(nearest) - truncation_ ? Relation::kFree
                                                                      : Relation::kMixed;
}

void BlockFusion::project(const Eigen::Vector3f& start, Row& row) const {
  const float x0 = start.x(), y0 = start.y(), z0 = start.z();
  const float dx = step_(0, 0), dy = step_(1, 0), dz = step_(2, 0);
  const float width = static_cast<float>(view_.width), height = static_cast<float>(view_.height);
  const float closest = closest_;
  const auto outside = static_cast<std::int32_t>(view_.outside());
  for (int i = 0; i < kBlockSide; ++i) {
    const auto n = static_cast<float>(i);
    const float z = z0 + n * dz;
    const float inverse = 1.0F / (z > closest ? z : closest);
    const float u = (x0 + n * dx) * inverse, v = (y0 + n * dy) * inverse;
    const bool inside = (z > closest) & (u >= 0.0F) & (v >= 0.0F) & (u < width) & (v < height);
    // Integers below 2^24 are exact in float, and SSE2 cannot multiply integers.
    const auto column = static_cast<float>(static_cast<std::int32_t>(inside ? u : 0.0F));
    const auto line = static_cast<float>(static_cast<std::int32_t>(inside ? v : 0.0F));
    const auto index = static_cast<std::int32_t>(line * width + column);
    const auto place = static_cast<std::size_t>(i);
    row.z[place] = z;
    row.index[place] = inside ? index : outside;
  }
  for (std::size_t i = 0; i < kBlockSide; ++i)
    row.pixel[i] = view_.pixels[static_cast<std::size_t>(row.index[i])];
}

void BlockFusion::update(Row& row, std::size_t first, VoxelBlock& block) const {
  float* const distance = &block.distance[first];
  float* const weight = &block.weight[first];
  const float truncation = truncation_, near = near_, max_weight = max_weight_;
  const float ramp = 1.0F / (truncation_ - voxel_);
  const float variance = variance_, quadratic = quadratic_variance_;
  std::uint32_t moved = 0, near_bits = 0;
  for (std::size_t i = 0; i < kBlockSide; ++i) {
    const auto mm = static_cast<std::int32_t>(row.pixel[i] & 0xFFFFU);
    const float depth = 0.001F * static_cast<float>(mm);
    const float s = depth - row.z[i];
    const bool observed = (mm > 0) & (s > -truncation);
    const float squared = depth * depth;
    float w = variance / (variance + quadratic * squared * squared);
    const float fade = (truncation + s) * ramp;
    w *= fade < 1.0F ? fade : 1.0F;
    w = observed ? w : 0.0F;
    const float sum = weight[i] + w;
    const float mean = w > 0.0F ? distance[i] + ((s < truncation ? s : truncation) - distance[i]) *
                                                    (w / (sum > 0.0F ? sum : 1.0F))
                                : distance[i];
    moved |= mean != distance[i] ? 1U : 0U;
    near_bits |= (observed & (s > -near) & (s < near)) ? 1U << i : 0U;
    distance[i] = mean;
    weight[i] = sum < max_weight ? sum : max_weight;
    row.observed_weight[i] = w;
  }
  for (std::size_t i = 0; i < kBlockSide; ++i) {
    std::uint8_t& views = block.views[first + i];
    views =
        static_cast<std::uint8_t>(views + (row.observed_weight[i] > 0.0F && views < 255 ? 1 : 0));
  }
  row.moved = moved != 0;
  row.near_bits = near_bits;
}

void BlockFusion::vote(const Row& row, VoxelLabels* labels) const {
  for (std::size_t i = 0; i < kBlockSide; ++i) {
    const LabelId label = DepthView::label(row.pixel[i]);
    if ((row.near_bits >> i & 1U) != 0 && label != 0)
      labels[i].observe(label, VoxelLabels::votes_of(row.observed_weight[i]));
  }
}

// The colour of a voxel is that of its nearest views. A clearly better view replaces the colour,
// and one of the same quality moves it by a quarter.
void BlockFusion::tint(const Row& row, VoxelColor* colors) const {
  constexpr int kBetter = 16;
  for (std::size_t i = 0; i < kBlockSide; ++i) {
    if ((row.near_bits >> i & 1U) == 0) continue;
    const ColorImage::Pixel& seen = view_.colors[static_cast<std::size_t>(row.index[i])];
    const int quality = 1 + static_cast<int>(254.0F * std::sqrt(std::sqrt(row.observed_weight[i])));
    VoxelColor& voxel = colors[i];
    if (quality + kBetter < voxel.quality) continue;
    const bool replaces = quality > voxel.quality + kBetter || voxel.quality == 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = std::min(gain_ * static_cast<float>(seen[c]), 255.0F);
      const auto before = static_cast<float>(voxel.color[c]);
      voxel.color[c] =
          static_cast<std::uint8_t>((replaces ? value : before + 0.25F * (value - before)) + 0.5F);
    }
    voxel.quality = static_cast<std::uint8_t>(std::max<int>(voxel.quality, quality));
  }
}

void BlockFusion::fuse(VoxelBlock& block) const {
  const Eigen::Vector3f corner = corner_of(block);
  const bool labelled = view_.labelled && block.labels != nullptr;
  bool moved = false, near = false;
  Row row;
  for (std::size_t r = 0; r < kBlockRows; ++r) {
    const auto y = static_cast<float>(r % kBlockSide), z = static_cast<float>(r / kBlockSide);
    project(corner + y * step_.col(1) + z * step_.col(2), row);
    const std::size_t first = r * kBlockSide;
    update(row, first, block);
    moved |= row.moved;
    if (row.near_bits == 0) continue;
    near = true;
    block.near_rows[r] = static_cast<std::uint8_t>(block.near_rows[r] | row.near_bits);
    if (labelled) vote(row, &(*block.labels)[first]);
    if (block.colors != nullptr && !view_.colors.empty()) tint(row, &(*block.colors)[first]);
  }
  if (near) block.last_seen = keyframe_;
  if ((moved || near) && !block.changed) {
    block.changed = true;
    block.changed_since = keyframe_;
  }
}

void BlockFusion::fuse_free(VoxelBlock& block) const {
  const Eigen::Vector3f middle = corner_of(block) + step_ * Eigen::Vector3f::Constant(3.5F);
  const float w = weight_of(middle.z());
  const float truncation = truncation_, max_weight = max_weight_;
  std::uint32_t moved = 0;
  for (std::size_t i = 0; i < kBlockVoxels; ++i) {
    const float sum = block.weight[i] + w;
    const float mean = block.distance[i] + (truncation - block.distance[i]) * (w / sum);
    moved |= mean != block.distance[i] ? 1U : 0U;
    block.distance[i] = mean;
    block.weight[i] = sum < max_weight ? sum : max_weight;
  }
  for (std::uint8_t& views : block.views) views = static_cast<std::uint8_t>(views + (views < 255));
  if (moved != 0 && !block.changed) {
    block.changed = true;
    block.changed_since = keyframe_;
  }
}

bool BlockFusion::is_empty(const VoxelBlock& block) const {
  const float threshold = 0.75F * truncation_;
  std::uint32_t surface = 0;
  for (std::size_t i = 0; i < kBlockVoxels; ++i)
    surface |= static_cast<std::uint32_t>(block.weight[i] > 0.0F) &
               static_cast<std::uint32_t>(block.distance[i] < threshold);
  return surface == 0;
}

}  // namespace km
