#include "modules/semantic_mapping/depth_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr std::uint32_t kNoSource = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint32_t kOutside = 1U << 31U;  // code of a label that the palette lacks
constexpr std::uint32_t kLabelBits = 0xFF0000U;
constexpr std::uint32_t kNoDepth = 65535;  // value of some sensors for no depth, in addition to 0
constexpr double kMaxGrowth = 2.0;  // bound on the size of the ideal image relative to the real one

// Extent of the bearings of an image.
struct BearingBounds {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Zero();

  void add(const Camera& camera, int u, int v) {
    const auto bearing = camera.unproject(Eigen::Vector2d(u, v));
    if (!bearing) return;
    low = low.cwiseMin(*bearing);
    high = high.cwiseMax(*bearing);
  }
};

// Uses all pixels and not only the border, because the corners of a fisheye image have no bearings.
BearingBounds bounds_of(const Camera& camera) {
  BearingBounds bounds;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) bounds.add(camera, u, v);
  return bounds;
}

// The pixel of the distorted image that shows `bearing`.
std::uint32_t source_of(const Camera& camera, const Eigen::Vector2d& bearing) {
  const auto px = camera.project(bearing);
  if (!px) return kNoSource;
  const double u = std::floor(px->x() + 0.5), v = std::floor(px->y() + 0.5);
  if (!(u >= 0.0 && v >= 0.0 && u < camera.width && v < camera.height)) return kNoSource;
  return static_cast<std::uint32_t>(v) * static_cast<std::uint32_t>(camera.width) +
         static_cast<std::uint32_t>(u);
}

}  // namespace

DepthViewMaker::DepthViewMaker(const Camera& camera, double min_range_m, double max_range_m,
                               const LabelPalette& palette) {
  if (camera.width <= 0 || camera.height <= 0 || !(camera.fx > 0.0) || !(camera.fy > 0.0))
    throw std::invalid_argument("mapping: a camera of " + std::to_string(camera.width) + " x " +
                                std::to_string(camera.height) + " px and focal lengths " +
                                std::to_string(camera.fx) + ", " + std::to_string(camera.fy) +
                                " px");
  min_mm_ = static_cast<std::uint32_t>(std::max(1.0, std::ceil(1000.0 * min_range_m)));
  max_mm_ = std::min(kNoDepth - 1, static_cast<std::uint32_t>(1000.0 * max_range_m));
  for (std::size_t id = 1; id < codes_.size(); ++id)
    codes_[id] = palette.find(static_cast<LabelId>(id)) != nullptr
                     ? static_cast<std::uint32_t>(id) << 16U
                     : kOutside;

  view_.width = camera.width;
  view_.height = camera.height;
  view_.fx = static_cast<float>(camera.fx);
  view_.fy = static_cast<float>(camera.fy);
  view_.cx = static_cast<float>(camera.cx);
  view_.cy = static_cast<float>(camera.cy);
  if (!camera.lens.is_ideal()) plan_rectification(camera);
  view_.pixels.assign(
      static_cast<std::size_t>(view_.width) * static_cast<std::size_t>(view_.height) + 1, 0);
  view_.tile_columns = (view_.width + DepthView::kTileSide - 1) / DepthView::kTileSide;
  view_.tile_rows = (view_.height + DepthView::kTileSide - 1) / DepthView::kTileSide;
  const auto tiles =
      static_cast<std::size_t>(view_.tile_columns) * static_cast<std::size_t>(view_.tile_rows);
  view_.nearest.assign(tiles, 0);
  view_.farthest.assign(tiles, 0);
  off_palette_.resize(static_cast<std::size_t>(view_.tile_rows));
}

void DepthViewMaker::plan_rectification(const Camera& camera) {
  const BearingBounds bounds = bounds_of(camera);
  const Eigen::Vector2d focal(camera.fx, camera.fy);
  const Eigen::Vector2d largest(kMaxGrowth * camera.width, kMaxGrowth * camera.height);
  // Pixels from the principal point to the borders, scaled down if their sum is too large.
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

std::size_t DepthViewMaker::fill(std::size_t begin, std::size_t end, const DepthImage& depth,
                                 const LabelImage* labels) {
  const std::uint16_t* millimetres = depth.millimetres.data();
  const LabelId* ids = labels != nullptr ? labels->ids.data() : nullptr;
  const std::uint32_t low = min_mm_, high = max_mm_;
  const auto in_range = [=](std::uint32_t mm) { return mm >= low && mm <= high ? mm : 0U; };
  std::uint32_t* pixels = view_.pixels.data();
  std::size_t outside = 0;
  if (source_.empty() && ids == nullptr) {
    for (std::size_t i = begin; i < end; ++i) pixels[i] = in_range(millimetres[i]);
    return outside;
  }
  for (std::size_t i = begin; i < end; ++i) {
    const std::size_t from = source_.empty() ? i : source_[i];
    const std::uint32_t code = from != kNoSource && ids != nullptr ? codes_[ids[from]] : 0U;
    const std::uint32_t mm = from != kNoSource ? in_range(millimetres[from]) : 0U;
    pixels[i] = mm | (code & kLabelBits);
    outside += code >> 31U;
  }
  return outside;
}

// Minimum and maximum by columns first, so that whole rows are processed at a time.
void DepthViewMaker::summarise(int row) {
  const auto width = static_cast<std::size_t>(view_.width);
  const int first = row * DepthView::kTileSide;
  const int last = std::min(view_.height, first + DepthView::kTileSide);
  std::vector<std::int32_t> nearest(width, kNoDepth), farthest(width, 0);
  for (int v = first; v < last; ++v) {
    const std::uint32_t* line = &view_.pixels[static_cast<std::size_t>(v) * width];
    for (std::size_t u = 0; u < width; ++u) {
      const auto mm = static_cast<std::int32_t>(line[u] & 0xFFFFU);
      nearest[u] = mm < nearest[u] ? mm : nearest[u];
      farthest[u] = mm > farthest[u] ? mm : farthest[u];
    }
  }
  for (int column = 0; column < view_.tile_columns; ++column) {
    const auto begin = static_cast<std::ptrdiff_t>(column) * DepthView::kTileSide;
    const auto end = std::min<std::ptrdiff_t>(view_.width, begin + DepthView::kTileSide);
    const auto tile = static_cast<std::size_t>(row * view_.tile_columns + column);
    view_.nearest[tile] = static_cast<std::uint16_t>(
        *std::min_element(nearest.begin() + begin, nearest.begin() + end));
    view_.farthest[tile] = static_cast<std::uint16_t>(
        *std::max_element(farthest.begin() + begin, farthest.begin() + end));
  }
}

// Returns the number of pixels whose label the palette lacks.
std::size_t DepthViewMaker::make_strip(int row, const DepthImage& depth, const LabelImage* labels) {
  const auto width = static_cast<std::size_t>(view_.width);
  const auto begin = static_cast<std::size_t>(row * DepthView::kTileSide);
  const std::size_t end = std::min(static_cast<std::size_t>(view_.height),
                                   begin + static_cast<std::size_t>(DepthView::kTileSide));
  const std::size_t off_palette = fill(begin * width, end * width, depth, labels);
  summarise(row);
  return off_palette;
}

const DepthView& DepthViewMaker::make(const DepthImage& depth, const LabelImage* labels,
                                      const ColorImage* color) {
  view_.colors.clear();
  if (color != nullptr) {
    view_.colors.assign(view_.pixels.size(), ColorImage::Pixel());
    for (std::size_t i = 0; i < view_.outside(); ++i) {
      const std::size_t from = source_.empty() ? i : source_[i];
      if (from != kNoSource) view_.colors[i] = color->pixels[from];
    }
  }
  cv::parallel_for_(cv::Range(0, view_.tile_rows), [&](const cv::Range& range) {
    for (int row = range.start; row < range.end; ++row)
      off_palette_[static_cast<std::size_t>(row)] = make_strip(row, depth, labels);
  });
  view_.labelled = labels != nullptr;
  view_.off_palette_pixels =
      std::accumulate(off_palette_.begin(), off_palette_.end(), std::size_t{0});
  return view_;
}

}  // namespace km
