#include "modules/map_2d/floor_heights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>

namespace km {
namespace {

constexpr double kTile_m = 2.0;
constexpr double kBin_m = 0.1;        // side of a bin in the histogram of a tile
constexpr double kSignificant = 0.2;  // least share of the area of the highest peak
constexpr double kFloor_m2 = 0.04;    // least area of the floor in a tile
constexpr double kWide_m2 = 2.0;      // area from which a raised tile is no table
constexpr double kFloor_cover = 0.1;  // least area of the floor in a cell, in cells
constexpr std::array<std::array<int, 2>, 8> kAround = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};

// Calls visit(x, y, index) for the cells around one.
template <typename Visit>
void for_around(const CellGrid& grid, std::uint32_t cell, const Visit& visit) {
  const int x = static_cast<int>(cell % static_cast<std::uint32_t>(grid.width));
  const int y = static_cast<int>(cell / static_cast<std::uint32_t>(grid.width));
  for (const auto& [dx, dy] : kAround)
    if (grid.contains(x + dx, y + dy)) visit(grid.index(x + dx, y + dy));
}

// Mean height of a run of layers of at least `kind` that begins at layer `first`: steps without a
// gap, over at most kBin_m. nullopt if it covers too little of the cell.
std::optional<float> height_of_run(std::span<const SurfaceLayer> layers, std::size_t first,
                                   SurfaceKind kind, double cell_m2) {
  double area = 0.0, moment = 0.0;
  const double limit_m = SurfaceColumns::height_m(layers[first]) + kBin_m;
  for (std::size_t k = first; k < layers.size(); ++k) {
    const double z = SurfaceColumns::height_m(layers[k]);
    if (z > limit_m) break;
    if (layers[k].kind < kind) continue;
    area += layers[k].area_m2;
    moment += layers[k].area_m2 * z;
  }
  if (area < kFloor_cover * cell_m2) return std::nullopt;
  return static_cast<float>(moment / area);
}

// Height of the lowest surface of at least `kind` in a cell at which accepts(height).
template <typename Accepts>
std::optional<float> lowest_surface(const SurfaceColumns& columns, std::uint32_t cell,
                                    SurfaceKind kind, const Accepts& accepts) {
  const auto layers = columns[cell];
  for (std::size_t k = 0; k < layers.size(); ++k) {
    if (layers[k].kind < kind) continue;
    const auto height = height_of_run(layers, k, kind, columns.grid().area_m2());
    if (height && accepts(*height)) return height;
  }
  return std::nullopt;
}

// Level surface of the tiles of a grid.
class Tiles {
 public:
  explicit Tiles(const SurfaceColumns& columns)
      : side_(std::max(1, static_cast<int>(std::lround(kTile_m / columns.grid().resolution_m)))),
        width_((columns.grid().width + side_ - 1) / side_),
        height_((columns.grid().height + side_ - 1) / side_),
        floors_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) floors_[at(x, y)] = floor_in(columns, x, y);
  }

  // Height of the floor in the tile of a cell; nullopt if unknown or perhaps a table.
  [[nodiscard]] std::optional<float> height_at(int cell_x, int cell_y, double max_step_m) const {
    const int x = cell_x / side_, y = cell_y / side_;
    const std::optional<Peak>& own = floors_[at(x, y)];
    if (!own) return std::nullopt;
    for (const auto& [dx, dy] : kAround) {
      if (x + dx < 0 || y + dy < 0 || x + dx >= width_ || y + dy >= height_) continue;
      const std::optional<Peak>& other = floors_[at(x + dx, y + dy)];
      if (other && own->height_m - other->height_m > max_step_m && own->area_m2 < kWide_m2)
        return std::nullopt;
    }
    return static_cast<float>(own->height_m);
  }

 private:
  struct Peak {
    double height_m = 0.0, area_m2 = 0.0;
  };

  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(width_) * static_cast<std::size_t>(y);
  }

  [[nodiscard]] std::optional<Peak> floor_in(const SurfaceColumns& columns, int tile_x,
                                             int tile_y) const {
    struct Sum {
      double area = 0.0, moment = 0.0;
    };
    std::map<int, Sum> bins;
    const CellGrid& grid = columns.grid();
    for (int y = tile_y * side_; y < std::min((tile_y + 1) * side_, grid.height); ++y)
      for (int x = tile_x * side_; x < std::min((tile_x + 1) * side_, grid.width); ++x)
        for (const SurfaceLayer& layer : columns[grid.index(x, y)])
          if (layer.kind != SurfaceKind::kOther) {
            const double z = SurfaceColumns::height_m(layer);
            Sum& sum = bins[static_cast<int>(std::floor(z / kBin_m))];
            sum.area += layer.area_m2;
            sum.moment += layer.area_m2 * z;
          }
    // Peaks are sums of two bins, so that no peak is divided.
    double highest = 0.0;
    const auto two = [&](std::map<int, Sum>::const_iterator bin) {
      Sum sum = bin->second;
      if (const auto next = bins.find(bin->first + 1); next != bins.end()) {
        sum.area += next->second.area;
        sum.moment += next->second.moment;
      }
      return sum;
    };
    for (auto bin = bins.cbegin(); bin != bins.cend(); ++bin)
      highest = std::max(highest, two(bin).area);
    for (auto bin = bins.cbegin(); bin != bins.cend(); ++bin)
      if (const Sum sum = two(bin); sum.area >= std::max(kSignificant * highest, kFloor_m2))
        return Peak{sum.moment / sum.area, sum.area};
    return std::nullopt;
  }

  int side_, width_, height_;
  std::vector<std::optional<Peak>> floors_;
};

class FloorSearch {
 public:
  explicit FloorSearch(const SurfaceColumns& columns) : columns_(columns), grid_(columns.grid()) {
    floor_.height_m.assign(grid_.size(), FloorHeights::kNone);
    floor_.is_seen.assign(grid_.size(), false);
  }

  void seed_by_labels() {
    for (std::uint32_t cell = 0; cell < grid_.size(); ++cell)
      set(cell, lowest_surface(columns_, cell, SurfaceKind::kFloor, [](float) { return true; }));
  }

  void seed_by_height(double max_step_m) {
    const Tiles tiles(columns_);
    for (int y = 0; y < grid_.height; ++y)
      for (int x = 0; x < grid_.width; ++x)
        if (const auto height = tiles.height_at(x, y, max_step_m))
          set(grid_.index(x, y),
              lowest_surface(columns_, grid_.index(x, y), SurfaceKind::kTop,
                             [&](float found) { return std::abs(found - *height) <= kBin_m; }));
  }

  // Over surface of at least `kind`.
  void grow(SurfaceKind kind) {
    while (!queue_.empty()) {
      const std::uint32_t cell = queue_.front();
      queue_.pop_front();
      const float from = floor_.height_m[cell];
      for_around(grid_, cell, [&](std::uint32_t next) {
        if (!floor_.is_seen[next]) set(next, level_with(next, kind, from));
      });
    }
  }

  // Precondition: extend() was called.
  void add_tops() {
    for (std::uint32_t cell = 0; cell < grid_.size(); ++cell)
      if (!floor_.is_seen[cell] && level_with(cell, SurfaceKind::kTop, floor_.height_m[cell]))
        floor_.is_seen[cell] = true;
  }

  // Breadth first from all seen cells, so that each cell gets the height of a nearest one.
  void extend() {
    std::vector<std::uint16_t> steps(grid_.size(), 0);
    const auto most = static_cast<int>(FloorHeights::kReach_m / grid_.resolution_m);
    for (std::uint32_t cell = 0; cell < grid_.size(); ++cell)
      if (floor_.is_seen[cell]) queue_.push_back(cell);
    while (!queue_.empty()) {
      const std::uint32_t cell = queue_.front();
      queue_.pop_front();
      if (steps[cell] >= most) continue;
      for_around(grid_, cell, [&](std::uint32_t next) {
        if (!std::isnan(floor_.height_m[next])) return;
        floor_.height_m[next] = floor_.height_m[cell];
        steps[next] = static_cast<std::uint16_t>(steps[cell] + 1);
        queue_.push_back(next);
      });
    }
  }

  FloorHeights take() { return std::move(floor_); }

 private:
  // Height of surface in a cell that continues floor at another height; none if that is NaN.
  [[nodiscard]] std::optional<float> level_with(std::uint32_t cell, SurfaceKind kind,
                                                float height_m) const {
    const double climb_m = grid_.resolution_m + SurfaceColumns::kStep_m;
    return lowest_surface(columns_, cell, kind,
                          [&](float found) { return std::abs(found - height_m) <= climb_m; });
  }

  void set(std::uint32_t cell, std::optional<float> height) {
    if (!height) return;
    floor_.height_m[cell] = *height;
    floor_.is_seen[cell] = true;
    queue_.push_back(cell);
  }

  const SurfaceColumns& columns_;
  const CellGrid& grid_;
  FloorHeights floor_;
  std::deque<std::uint32_t> queue_;
};

}  // namespace

FloorHeights find_floor(const SurfaceColumns& columns, double max_step_m) {
  FloorSearch search(columns);
  const bool is_labelled = columns.area_m2(SurfaceKind::kFloor) > kFloor_m2;
  if (is_labelled)
    search.seed_by_labels();
  else
    search.seed_by_height(max_step_m);
  search.grow(is_labelled ? SurfaceKind::kLevel : SurfaceKind::kTop);
  search.extend();
  if (is_labelled) search.add_tops();
  return search.take();
}

}  // namespace km
