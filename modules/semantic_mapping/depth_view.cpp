#include "modules/semantic_mapping/depth_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr std::uint32_t kNoSource = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint32_t kNoDepth = 65535;  // beside 0, by some sensors
constexpr double kMaxGrowth = 2.0;         // of the ideal image against the real one

bool distorted(const PinholeCamera& camera) {
  return std::any_of(camera.distortion.begin(), camera.distortion.end(),
                     [](double k) { return k != 0.0; });
}

// Extent of the bearings along the image's border.
struct BearingBounds {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Zero();

  void add(const PinholeCamera& camera, int u, int v) {
    const auto bearing = camera.unproject(Eigen::Vector2d(u, v));
    if (!bearing) return;
    low = low.cwiseMin(*bearing);
    high = high.cwiseMax(*bearing);
  }
};

BearingBounds border_of(const PinholeCamera& camera) {
  BearingBounds bounds;
  for (int u = 0; u < camera.width; ++u) {
    bounds.add(camera, u, 0);
    bounds.add(camera, u, camera.height - 1);
  }
  for (int v = 0; v < camera.height; ++v) {
    bounds.add(camera, 0, v);
    bounds.add(camera, camera.width - 1, v);
  }
  return bounds;
}

// The pixel of the distorted image that shows `bearing`. Beyond where the distortion folds back,
// project() lands in the image again: the way back tells.
std::uint32_t source_of(const PinholeCamera& camera, const Eigen::Vector2d& bearing) {
  const Eigen::Vector2d px = camera.project(bearing);
  const double u = std::floor(px.x() + 0.5), v = std::floor(px.y() + 0.5);
  if (!(u >= 0.0 && v >= 0.0 && u < camera.width && v < camera.height)) return kNoSource;
  const auto back = camera.unproject(px);
  if (!back || (*back - bearing).norm() > 1e-3) return kNoSource;
  return static_cast<std::uint32_t>(v) * static_cast<std::uint32_t>(camera.width) +
         static_cast<std::uint32_t>(u);
}

}  // namespace

DepthViewMaker::DepthViewMaker(const PinholeCamera& camera, double min_range_m, double max_range_m,
                               const LabelPalette& palette) {
  if (camera.width <= 0 || camera.height <= 0 || !(camera.fx > 0.0) || !(camera.fy > 0.0))
    throw std::invalid_argument("mapping: a camera of " + std::to_string(camera.width) + " x " +
                                std::to_string(camera.height) + " px and focal lengths " +
                                std::to_string(camera.fx) + ", " + std::to_string(camera.fy) +
                                " px");
  min_mm_ = static_cast<std::uint32_t>(std::max(1.0, std::ceil(1000.0 * min_range_m)));
  max_mm_ = std::min(kNoDepth - 1, static_cast<std::uint32_t>(1000.0 * max_range_m));
  for (std::size_t id = 0; id < known_.size(); ++id) {
    const auto label = static_cast<LabelId>(id);
    const bool known = palette.find(label) != nullptr;
    known_[id] = known ? label : LabelId{0};
    outside_[id] = known || label == 0 ? 0 : 1;
  }

  view_.width = camera.width;
  view_.height = camera.height;
  view_.fx = static_cast<float>(camera.fx);
  view_.fy = static_cast<float>(camera.fy);
  view_.cx = static_cast<float>(camera.cx);
  view_.cy = static_cast<float>(camera.cy);
  if (distorted(camera)) plan_rectification(camera);
  view_.pixels.assign(
      static_cast<std::size_t>(view_.width) * static_cast<std::size_t>(view_.height) + 1, 0);
  view_.tile_columns = (view_.width + DepthView::kTileSide - 1) / DepthView::kTileSide;
  view_.tile_rows = (view_.height + DepthView::kTileSide - 1) / DepthView::kTileSide;
  const auto tiles =
      static_cast<std::size_t>(view_.tile_columns) * static_cast<std::size_t>(view_.tile_rows);
  view_.nearest.assign(tiles, 0);
  view_.farthest.assign(tiles, 0);
}

void DepthViewMaker::plan_rectification(const PinholeCamera& camera) {
  const BearingBounds bounds = border_of(camera);
  const Eigen::Vector2d focal(camera.fx, camera.fy);
  const Eigen::Vector2d largest(kMaxGrowth * camera.width, kMaxGrowth * camera.height);
  // Pixels from the principal point to the borders, scaled down where both together are too many.
  Eigen::Vector2d before = -focal.cwiseProduct(bounds.low), after = focal.cwiseProduct(bounds.high);
  const Eigen::Vector2d scale =
      largest.cwiseQuotient((before + after).cwiseMax(largest)).cwiseMin(1.0);
  before = before.cwiseProduct(scale).array().ceil();
  after = after.cwiseProduct(scale).array().ceil();

  view_.cx = static_cast<float>(before.x());
  view_.cy = static_cast<float>(before.y());
  view_.width = static_cast<int>(before.x() + after.x()) + 1;
  view_.height = static_cast<int>(before.y() + after.y()) + 1;
  source_.reserve(static_cast<std::size_t>(view_.width) * static_cast<std::size_t>(view_.height));
  for (int v = 0; v < view_.height; ++v)
    for (int u = 0; u < view_.width; ++u)
      source_.push_back(
          source_of(camera, Eigen::Vector2d(u - before.x(), v - before.y()).cwiseQuotient(focal)));
}

std::uint32_t DepthViewMaker::pack(std::uint16_t millimetres, LabelId label) const {
  const std::uint32_t mm = millimetres;
  return (mm >= min_mm_ && mm <= max_mm_ ? mm : 0U) | static_cast<std::uint32_t>(known_[label])
                                                          << 16U;
}

void DepthViewMaker::fill_plain(const DepthImage& depth, const LabelImage* labels) {
  const std::size_t n = depth.millimetres.size();
  const std::uint16_t* mm = depth.millimetres.data();
  std::uint32_t* pixel = view_.pixels.data();
  if (labels == nullptr) {
    const std::uint32_t low = min_mm_, high = max_mm_;
    for (std::size_t i = 0; i < n; ++i) pixel[i] = mm[i] >= low && mm[i] <= high ? mm[i] : 0U;
    return;
  }
  const LabelId* label = labels->ids.data();
  for (std::size_t i = 0; i < n; ++i) pixel[i] = pack(mm[i], label[i]);
}

void DepthViewMaker::fill_rectified(const DepthImage& depth, const LabelImage* labels) {
  for (std::size_t i = 0; i < source_.size(); ++i) {
    const std::uint32_t from = source_[i];
    view_.pixels[i] = from == kNoSource ? 0U
                                        : pack(depth.millimetres[from],
                                               labels != nullptr ? labels->ids[from] : LabelId{0});
  }
}

void DepthViewMaker::summarise_tiles() {
  constexpr int kSide = DepthView::kTileSide;
  const auto width = static_cast<std::size_t>(view_.width);
  view_.with_depth = 0;
  for (int row = 0; row < view_.tile_rows; ++row)
    for (int column = 0; column < view_.tile_columns; ++column) {
      const int u_end = std::min(view_.width, (column + 1) * kSide);
      const int v_end = std::min(view_.height, (row + 1) * kSide);
      std::uint32_t nearest = kNoDepth, farthest = 0, count = 0;
      for (int v = row * kSide; v < v_end; ++v) {
        const std::uint32_t* line = &view_.pixels[static_cast<std::size_t>(v) * width];
        for (int u = column * kSide; u < u_end; ++u) {
          const std::uint32_t mm = line[u] & 0xFFFFU;
          nearest = mm < nearest ? mm : nearest;
          farthest = mm > farthest ? mm : farthest;
          count += mm > 0 ? 1 : 0;
        }
      }
      const auto tile = static_cast<std::size_t>(row * view_.tile_columns + column);
      view_.nearest[tile] = static_cast<std::uint16_t>(nearest);
      view_.farthest[tile] = static_cast<std::uint16_t>(farthest);
      view_.with_depth += count;
    }
}

const DepthView& DepthViewMaker::make(const DepthImage& depth, const LabelImage* labels) {
  if (source_.empty()) {
    fill_plain(depth, labels);
  } else {
    fill_rectified(depth, labels);
  }
  view_.labelled = labels != nullptr;
  view_.labels_outside = 0;
  if (labels != nullptr)
    for (const LabelId label : labels->ids) view_.labels_outside += outside_[label];
  summarise_tiles();
  return view_;
}

}  // namespace km
