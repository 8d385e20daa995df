#include "modules/view/view_raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "modules/core/distance_color.hpp"
#include "modules/view/view_update.hpp"

namespace km {
namespace {

constexpr std::size_t kRasterHead_bytes = 64;
constexpr std::size_t kLongest_run = 255;
constexpr double kMaxSliceCells = 1 << 26;

bool is_value(RasterKind kind, std::uint8_t value) {
  const std::uint8_t most =
      kind == RasterKind::kOccupancy ? ViewRaster::kFree : ViewRaster::kFarthest;
  return value <= most || value == ViewRaster::kUnknown;
}

// Cells of a raster that may still be too large.
struct Cells {
  std::size_t width, height;
  std::vector<std::uint8_t> values;
};

Cells halved(const Cells& cells) {
  Cells half{(cells.width + 1) / 2, (cells.height + 1) / 2, {}};
  half.values.assign(half.width * half.height, ViewRaster::kUnknown);
  for (std::size_t y = 0; y < cells.height; ++y)
    for (std::size_t x = 0; x < cells.width; ++x) {
      std::uint8_t& value = half.values[x / 2 + half.width * (y / 2)];
      value = std::min(value, cells.values[x + cells.width * y]);
    }
  return half;
}

std::vector<std::uint8_t> runs_of(const std::vector<std::uint8_t>& values) {
  std::vector<std::uint8_t> runs;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    while (end < values.size() && end - begin < kLongest_run && values[end] == values[begin]) ++end;
    runs.push_back(static_cast<std::uint8_t>(end - begin));
    runs.push_back(values[begin]);
  }
  return runs;
}

// Halves the cells until the raster fits.
ViewRaster fitted(ViewRaster raster, Cells cells) {
  while (true) {
    raster.width = static_cast<std::uint32_t>(cells.width);
    raster.height = static_cast<std::uint32_t>(cells.height);
    if (std::max(cells.width, cells.height) <= ViewRaster::kMaxSide &&
        cells.values.size() <= ViewRaster::kMaxCells) {
      raster.runs = runs_of(cells.values);
      if (raster.runs.size() + kRasterHead_bytes <= kMaxViewBytes) return raster;
    }
    cells = halved(cells);
    raster.resolution_m *= 2.0F;
  }
}

// Distance between neighbours along x; infinite if no two consecutive points are in one row.
float spacing_of(const std::vector<Eigen::Vector3f>& points) {
  float spacing = std::numeric_limits<float>::infinity();
  for (std::size_t k = 1; k < points.size(); ++k) {
    const float step = std::abs(points[k].x() - points[k - 1].x());
    if (points[k].y() == points[k - 1].y() && step > 0.0F) spacing = std::min(spacing, step);
  }
  return spacing;
}

}  // namespace

bool is_valid(const ViewRaster& raster) {
  const std::uint64_t cells = std::uint64_t{raster.width} * raster.height;
  if (raster.width > ViewRaster::kMaxSide || raster.height > ViewRaster::kMaxSide || cells == 0 ||
      cells > ViewRaster::kMaxCells || !(raster.resolution_m > 0.0F) || raster.runs.size() % 2 != 0)
    return false;
  std::uint64_t sum = 0;
  for (std::size_t k = 0; k < raster.runs.size(); k += 2) {
    if (raster.runs[k] == 0 || !is_value(raster.kind, raster.runs[k + 1])) return false;
    sum += raster.runs[k];
  }
  return sum == cells;
}

std::vector<std::uint8_t> cells_of(const ViewRaster& raster) {
  std::vector<std::uint8_t> cells;
  for (std::size_t k = 0; k < raster.runs.size(); k += 2)
    cells.insert(cells.end(), raster.runs[k], raster.runs[k + 1]);
  return cells;
}

std::optional<ViewRaster> view_raster(const OccupancyGrid& map) {
  if (map.empty()) return std::nullopt;
  Cells cells{static_cast<std::size_t>(map.width), static_cast<std::size_t>(map.height), {}};
  for (const std::int8_t cell : map.cells)
    cells.values.push_back(cell == OccupancyGrid::kUnknown ? ViewRaster::kUnknown
                           : cell == OccupancyGrid::kFree  ? ViewRaster::kFree
                                                           : ViewRaster::kOccupied);
  const Eigen::Vector2f corner = map.origin.cast<float>();
  return fitted({.kind = RasterKind::kOccupancy,
                 .anchor = map.anchor,
                 .resolution_m = static_cast<float>(map.resolution_m),
                 .origin = {corner.x(), corner.y(), static_cast<float>(map.z_m)}},
                std::move(cells));
}

std::optional<ViewRaster> view_raster(const LabelledMesh& slice, RobotId robot) {
  const std::vector<Eigen::Vector3f>& points = slice.vertices;
  const float spacing = spacing_of(points);
  if (!std::isfinite(spacing) || slice.colors.size() != points.size()) return std::nullopt;
  Eigen::Vector3f low = points.front(), high = low;
  for (const Eigen::Vector3f& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector2d sides =
      ((high - low).head<2>() / spacing).array().round().cast<double>() + 1.0;
  if (!(sides.prod() <= kMaxSliceCells)) return std::nullopt;
  Cells cells{static_cast<std::size_t>(sides.x()), static_cast<std::size_t>(sides.y()), {}};
  cells.values.assign(cells.width * cells.height, ViewRaster::kUnknown);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Eigen::Vector2f at = ((points[k] - low).head<2>() / spacing).array().round();
    cells
        .values[static_cast<std::size_t>(at.x()) + cells.width * static_cast<std::size_t>(at.y())] =
        static_cast<std::uint8_t>(distance_share(slice.colors[k]) * ViewRaster::kFarthest);
  }
  return fitted({.kind = RasterKind::kDistances,
                 .anchor = robot,
                 .resolution_m = spacing,
                 .origin = {low.x() - spacing / 2, low.y() - spacing / 2, low.z()}},
                std::move(cells));
}

}  // namespace km
