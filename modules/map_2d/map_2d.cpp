#include "modules/map_2d/map_2d.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "modules/map_2d/floor_heights.hpp"
#include "modules/map_2d/surface_columns.hpp"

namespace km {
namespace {

constexpr double kObstacle_cover = 0.25;  // least area of an obstacle in a cell, in cells
constexpr std::uint8_t kLeast_rays = 2;   // fewer rays may be wrong depths
constexpr int kEnd_cells = 2;             // before the end of a ray that are not counted as free

std::array<bool, 256> floor_ids(const LabelPalette& palette,
                                const std::vector<std::string>& names) {
  std::array<bool, 256> is_floor = {};
  for (const LabelClass& entry : palette.classes())
    is_floor[entry.id] = entry.id != 0 && std::ranges::find(names, entry.name) != names.end();
  return is_floor;
}

// Counts the rays through the lower part of the band of each cell.
class RayCounter {
 public:
  RayCounter(const Map2dConfig& config, const CellGrid& grid, const FloorHeights& floor)
      : config_(config), grid_(grid), floor_(floor), rays_(grid.size(), 0) {}

  void add(const Eigen::Vector3d& origin, const Eigen::Vector3d& end) {
    const Eigen::Vector3d a = in_cells(origin), b = in_cells(end), d = b - a;
    Eigen::Vector2i cell = a.head<2>().array().floor().cast<int>();
    const Eigen::Vector2i last = b.head<2>().array().floor().cast<int>();
    const int steps = (last - cell).cwiseAbs().sum();
    std::array<int, 2> step = {};
    std::array<double, 2> next = {kNever, kNever}, period = {kNever, kNever};
    for (int k = 0; k < 2; ++k) {
      if (d[k] == 0.0) continue;
      step[static_cast<std::size_t>(k)] = d[k] > 0 ? 1 : -1;
      period[static_cast<std::size_t>(k)] = std::abs(1.0 / d[k]);
      next[static_cast<std::size_t>(k)] = ((d[k] > 0 ? cell[k] + 1 : cell[k]) - a[k]) / d[k];
    }
    double t = 0.0;
    for (int n = 0; n < steps - kEnd_cells; ++n) {
      const int k = next[0] < next[1] ? 0 : 1;
      const double leaves = std::min(next[static_cast<std::size_t>(k)], 1.0);
      count(cell, origin.z() + (t + leaves) / 2 * (end.z() - origin.z()));
      t = leaves;
      cell[k] += step[static_cast<std::size_t>(k)];
      next[static_cast<std::size_t>(k)] += period[static_cast<std::size_t>(k)];
    }
  }

  [[nodiscard]] bool is_free(std::size_t cell) const { return rays_[cell] >= kLeast_rays; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  [[nodiscard]] Eigen::Vector3d in_cells(const Eigen::Vector3d& point) const {
    Eigen::Vector3d scaled = point / grid_.resolution_m;
    scaled.head<2>() -= grid_.origin / grid_.resolution_m;
    return scaled;
  }

  void count(const Eigen::Vector2i& cell, double z) {
    if (!grid_.contains(cell.x(), cell.y())) return;
    const std::uint32_t index = grid_.index(cell.x(), cell.y());
    const double above_m = z - static_cast<double>(floor_.height_m[index]);
    // A ray shows nothing about lower obstacles.
    if (above_m >= config_.min_height_m && above_m <= config_.min_height_m + config_.max_step_m &&
        rays_[index] < kLeast_rays)
      ++rays_[index];
  }

  const Map2dConfig& config_;
  const CellGrid& grid_;
  const FloorHeights& floor_;
  std::vector<std::uint8_t> rays_;
};

bool is_obstacle(const Map2dConfig& config, const SurfaceColumns& columns, std::uint32_t cell,
                 float floor_m) {
  double area_m2 = 0.0;
  for (const SurfaceLayer& layer : columns[cell]) {
    const double above_m = SurfaceColumns::height_m(layer) - static_cast<double>(floor_m);
    if (layer.kind != SurfaceKind::kFloor && above_m >= config.min_height_m &&
        above_m <= config.max_height_m)
      area_m2 += layer.area_m2;
  }
  return area_m2 >= kObstacle_cover * columns.grid().area_m2();
}

// True if the floor of a cell or of the cell beside it in x or y ends in a step between them.
bool is_step(const CellGrid& grid, const FloorHeights& floor, int x, int y, double max_step_m) {
  const std::uint32_t cell = grid.index(x, y);
  if (!floor.is_seen[cell]) return false;
  constexpr std::array<std::array<int, 2>, 4> kBeside = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  return std::ranges::any_of(kBeside, [&](const auto& offset) {
    if (!grid.contains(x + offset[0], y + offset[1])) return false;
    const std::uint32_t other = grid.index(x + offset[0], y + offset[1]);
    return floor.is_seen[other] &&
           static_cast<double>(std::abs(floor.height_m[cell] - floor.height_m[other])) > max_step_m;
  });
}

// Precondition: floor was seen.
double median_height_m(const FloorHeights& floor) {
  std::vector<float> seen;
  for (std::size_t cell = 0; cell < floor.is_seen.size(); ++cell)
    if (floor.is_seen[cell]) seen.push_back(floor.height_m[cell]);
  const auto middle = seen.begin() + static_cast<std::ptrdiff_t>(seen.size() / 2);
  std::ranges::nth_element(seen, middle);
  return static_cast<double>(*middle);
}

RayCounter count_rays(const Map2dConfig& config, const Map2dInput& input, const CellGrid& grid,
                      const FloorHeights& floor) {
  RayCounter counter(config, grid, floor);
  for (const ViewRays& view : input.views) {
    if (view.keyframe >= input.T_world_odom.size()) continue;
    const SE3& T_world_odom = input.T_world_odom[view.keyframe];
    const Eigen::Vector3d origin = T_world_odom * view.origin.cast<double>();
    for (const Eigen::Vector3f& end : view.ends)
      counter.add(origin, T_world_odom * end.cast<double>());
  }
  return counter;
}

}  // namespace

Map2dResult make_map_2d(const Map2dConfig& config, const Map2dInput& input) {
  Map2dResult result;
  const Eigen::Vector2d cells = cells_needed(input.mesh, config.resolution_m);
  result.cells_needed = cells.prod();
  if (input.mesh.faces.empty()) return result;
  if (result.cells_needed > kMaxMap2dCells) {
    result.status = Map2dStatus::kTooLarge;
    return result;
  }
  const CellGrid grid = grid_over(input.mesh, config.resolution_m);
  const SurfaceColumns columns(input.mesh, grid, floor_ids(input.palette, config.floor_labels));
  const FloorHeights floor = find_floor(columns, config.max_step_m);
  if (std::ranges::find(floor.is_seen, true) == floor.is_seen.end()) return result;
  const RayCounter rays = count_rays(config, input, grid, floor);

  result.status = Map2dStatus::kMade;
  OccupancyGrid& map = result.grid;
  map = {grid.resolution_m, grid.origin, grid.width, grid.height, {}};
  map.z_m = median_height_m(floor);
  map.cells.assign(grid.size(), OccupancyGrid::kUnknown);
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x) {
      const std::uint32_t cell = grid.index(x, y);
      if (std::isnan(floor.height_m[cell])) continue;
      if (is_obstacle(config, columns, cell, floor.height_m[cell]) ||
          is_step(grid, floor, x, y, config.max_step_m))
        map.cells[cell] = OccupancyGrid::kOccupied;
      else if (floor.is_seen[cell] || rays.is_free(cell))
        map.cells[cell] = OccupancyGrid::kFree;
    }
  return result;
}

}  // namespace km
