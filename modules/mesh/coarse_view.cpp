#include "modules/mesh/coarse_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace km {
namespace {

constexpr double kCell_rad = 0.02;
constexpr float kSigmas = 3.0F;

// Depth margin in patches. The mapper takes depths within two voxels as the same surface
// (kNearVoxels).
constexpr float kMarginPatches = 2.0F;

// Cells on each side of the middle beyond which a piece of surface counts as too near.
constexpr float kMaxReach_cells = 8.0F;

// Least share of a cell's pixels with a depth. Holes may hide a thin structure.
constexpr double kLeastShare = 0.75;

constexpr std::uint16_t kNoDepth_mm = 65535;  // value of some sensors for no depth

// Extent of the bearings of a camera.
std::pair<Eigen::Vector2d, Eigen::Vector2d> extent_of(const Camera& camera) {
  constexpr double kWidest = 3.0;  // tan(71.6 degrees)
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Zero();
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      if (const auto bearing = camera.unproject(Eigen::Vector2d(u, v))) {
        low = low.cwiseMin(*bearing);
        high = high.cwiseMax(*bearing);
      }
  return {low.cwiseMax(-kWidest), high.cwiseMin(kWidest)};
}

}  // namespace

Sight sight_of(const CoarseView& view, const Eigen::Vector3f& p_cam, float patch_m,
               const PoseSigma& sigma) {
  const float z = p_cam.z();
  const float radius_m = patch_m + kSigmas * sigma.translation_m;
  if (z <= radius_m) return Sight::kUnknown;
  const Eigen::Array2f middle =
      view.focal.array() * p_cam.head<2>().array() / z + view.center.array();
  const Eigen::Array2f reach = view.focal.array() * (radius_m / z + kSigmas * sigma.rotation_rad);
  const Eigen::Array2f low = middle - reach, high = middle + reach;
  const Eigen::Array2f size(static_cast<float>(view.columns), static_cast<float>(view.rows));
  if (!((low >= 0.0F).all() && (high < size).all() && (reach <= kMaxReach_cells).all()))
    return Sight::kUnknown;
  const auto depth_at = [&view](int column, int row) {
    return 0.001F * static_cast<float>(view.nearest_mm[static_cast<std::size_t>(row) *
                                                           static_cast<std::size_t>(view.columns) +
                                                       static_cast<std::size_t>(column)]);
  };
  const float base = kSigmas * static_cast<float>(view.noise.base_m);
  const float inverse = kSigmas * static_cast<float>(view.noise.per_m);
  const float margin = kMarginPatches * patch_m + kSigmas * sigma.translation_m;
  const float seen = depth_at(static_cast<int>(middle.x()), static_cast<int>(middle.y()));
  if (seen <= 0.0F) return Sight::kUnknown;
  if (std::abs(seen - z) <= margin + base + inverse * z * z) return Sight::kSurface;
  if (seen < z) return Sight::kUnknown;
  for (int row = static_cast<int>(low.y()); row <= static_cast<int>(high.y()); ++row)
    for (int column = static_cast<int>(low.x()); column <= static_cast<int>(high.x()); ++column) {
      const float depth = depth_at(column, row);
      if (depth / (1.0F + inverse * depth) - base <= z + margin) return Sight::kUnknown;
    }
  return Sight::kThrough;
}

CoarseViews::CoarseViews(const Camera& camera, const DepthNoise& noise, double min_range_m)
    : least_mm_(static_cast<std::uint16_t>(std::clamp(1000.0 * min_range_m, 1.0, 65000.0))) {
  if (camera.width <= 0 || camera.height <= 0 || !(camera.fx > 0.0) || !(camera.fy > 0.0))
    throw std::invalid_argument("coarse views: a camera without pixels or focal length");
  const auto [low, high] = extent_of(camera);
  // A cell has at least two pixels a side, so that it has some depth in images of few pixels.
  const Eigen::Vector2d cell =
      Eigen::Vector2d(2.0 / camera.fx, 2.0 / camera.fy).cwiseMax(kCell_rad);
  empty_.noise = noise;
  empty_.focal = cell.cwiseInverse().cast<float>();
  empty_.center = (-low.cwiseQuotient(cell)).cast<float>();
  empty_.columns = static_cast<int>((high.x() - low.x()) / cell.x()) + 1;
  empty_.rows = static_cast<int>((high.y() - low.y()) / cell.y()) + 1;
  const auto cells =
      static_cast<std::size_t>(empty_.columns) * static_cast<std::size_t>(empty_.rows);
  pixels_.assign(cells + 1, 0);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      auto place = static_cast<std::uint32_t>(cells);
      const auto bearing = camera.unproject(Eigen::Vector2d(u, v));
      if (bearing && (bearing->array() >= low.array()).all() &&
          (bearing->array() <= high.array()).all()) {
        const Eigen::Vector2i at = (*bearing - low).cwiseQuotient(cell).cast<int>();
        place = static_cast<std::uint32_t>(at.y() * empty_.columns + at.x());
      }
      cell_.push_back(place);
      ++pixels_[place];
    }
}

CoarseView CoarseViews::reduced(const DepthImage& depth) const {
  CoarseView view = empty_;
  const std::size_t cells = pixels_.size() - 1;
  std::vector<std::uint16_t> count(cells + 1, 0);
  view.nearest_mm.assign(cells + 1, std::numeric_limits<std::uint16_t>::max());
  for (std::size_t i = 0; i < cell_.size(); ++i) {
    const std::uint16_t mm = depth.millimetres[i];
    if (mm < least_mm_ || mm == kNoDepth_mm) continue;
    ++count[cell_[i]];
    view.nearest_mm[cell_[i]] = std::min(view.nearest_mm[cell_[i]], mm);
  }
  view.nearest_mm.pop_back();
  for (std::size_t c = 0; c < cells; ++c)
    if (count[c] == 0 || count[c] < kLeastShare * pixels_[c]) view.nearest_mm[c] = 0;
  view.farthest_m = 0.001F * static_cast<float>(*std::ranges::max_element(view.nearest_mm));
  return view;
}

void CoarseViews::add(const DepthImage& depth, const SE3& T_odom_cam, KeyframeIndex keyframe) {
  if (!spacing_.choose(T_odom_cam)) return;
  CoarseView view = reduced(depth);
  view.keyframe = keyframe;
  view.T_odom_cam = T_odom_cam;
  views_.push_back(std::make_shared<const CoarseView>(std::move(view)));
  if (views_.size() > kMaxViews) drop_old();
}

void CoarseViews::drop_old() {
  const std::size_t half = views_.size() / 2;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < views_.size(); ++i)
    if (i >= half || i % 2 == 0) views_[kept++] = std::move(views_[i]);
  views_.resize(kept);
}

}  // namespace km
