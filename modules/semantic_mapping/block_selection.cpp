#include "modules/semantic_mapping/block_selection.hpp"

#include <algorithm>

namespace km {
namespace {

// Samples are at most one voxel apart at the greatest depth of the view.
int stride_of(const DepthView& view, double voxel_size_m) {
  constexpr int kLongest = 16;  // [px]
  const std::uint16_t farthest = *std::max_element(view.farthest.begin(), view.farthest.end());
  const float focal = std::max(view.fx, view.fy);
  const float pixels =
      static_cast<float>(voxel_size_m) * focal / std::max(DepthView::depth_m(farthest), 0.1F);
  return static_cast<int>(std::clamp(pixels, 1.0F, static_cast<float>(kLongest)));
}

// Whole part towards minus infinity, for values above -kOffset.
Eigen::Vector3i floor_of(const Eigen::Vector3f& value) {
  constexpr float kOffset = 4096.0F;
  return (value.array() + kOffset).cast<int>() - static_cast<int>(kOffset);
}

class Selector {
 public:
  Selector(std::size_t max_blocks, std::uint64_t frame, KeyframeIndex keyframe, BlockMap& map)
      : max_blocks_(max_blocks), frame_(frame), keyframe_(keyframe), map_(map) {}

  // All blocks from `low` to `high`. Neighbouring samples mostly ask for the same.
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
      ++result_.allocated;
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

NearBlocks select_near_blocks(const DepthView& view, const SE3& T_odom_cam, double voxel_size_m,
                              std::size_t max_blocks, std::uint64_t frame, KeyframeIndex keyframe,
                              BlockMap& map) {
  const double block_m = kBlockSide * voxel_size_m;
  // In blocks, from that of the camera, so that float is exact enough however far the robot went.
  const Eigen::Vector3d camera = T_odom_cam.translation() / block_m;
  const Eigen::Vector3d base = camera.array().floor();
  const Eigen::Vector3f origin = (camera - base).cast<float>();
  const Eigen::Vector3i base_block = base.cwiseMax(-1e9).cwiseMin(1e9).cast<int>();
  const Eigen::Matrix3f R = (T_odom_cam.linear() / block_m).cast<float>();
  constexpr float kReach = kNearVoxels / static_cast<float>(kBlockSide);

  Selector selector(max_blocks, frame, keyframe, map);
  const int stride = stride_of(view, voxel_size_m);
  for (int v = stride / 2; v < view.height; v += stride) {
    const std::uint32_t* line =
        &view.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(view.width)];
    const float y = (static_cast<float>(v) - view.cy) / view.fy;
    const Eigen::Vector3f side = R.col(0) / view.fx;
    const Eigen::Vector3f start = y * R.col(1) + R.col(2) - view.cx * side;
    for (int u = stride / 2; u < view.width; u += stride) {
      const float depth = DepthView::depth_m(line[u]);
      if (depth <= 0.0F) continue;
      const Eigen::Vector3f point = origin + depth * (start + static_cast<float>(u) * side);
      selector.add(base_block + floor_of(point.array() - kReach),
                   base_block + floor_of(point.array() + kReach));
    }
  }
  return selector.result();
}

}  // namespace km
