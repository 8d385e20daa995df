#include "modules/distance_field/surface_distances.hpp"

#include <algorithm>

namespace km {
namespace {

// Squared distances of eight voxels along x.
using Lanes = std::array<std::int16_t, kBlockSide>;
// Those of eight voxels along x and eight along another axis.
using Tile = std::array<Lanes, kBlockSide>;

// Beyond every distance within reach. The sum with a square of less than 14 blocks fits 16 bits.
constexpr std::int16_t kNone = 20000;
constexpr int kFarAway = 1 << 12;  // [voxels]

constexpr Lanes kNoSurface = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};

std::int16_t largest(const Tile& tile) {
  Lanes most = tile[0];
  for (const Lanes& lanes : tile)
    for (std::size_t x = 0; x < most.size(); ++x) most[x] = std::max(most[x], lanes[x]);
  return *std::ranges::max_element(most);
}

// One q: `distance` is q - p for the first p of the tile.
void lower(const Lanes& f, int distance, Tile& tile) {
  for (Lanes& lanes : tile) {
    const auto square = static_cast<std::int16_t>(distance * distance);
    for (std::size_t x = 0; x < lanes.size(); ++x)
      lanes[x] = std::min(lanes[x], static_cast<std::int16_t>(f[x] + square));
    --distance;
  }
}

// The transform at the eight p of `block`, which may lie beside `f`. `used`: blocks of q with
// surface.
Tile transform(std::span<const Lanes> f, const std::vector<char>& used, int block, int reach) {
  Tile tile;
  tile.fill(kNoSurface);
  const auto compare = [&](int from) {
    if (from < 0 || from >= static_cast<int>(used.size()) ||
        used[static_cast<std::size_t>(from)] == 0)
      return;
    for (int q = from * kBlockSide; q < (from + 1) * kBlockSide; ++q)
      lower(f[static_cast<std::size_t>(q)], q - block * kBlockSide, tile);
  };
  compare(block);
  for (int step = 1;; ++step) {
    const int gap = (step - 1) * kBlockSide + 1;
    if (gap > reach || gap * gap >= largest(tile)) return tile;
    compare(block - step);
    compare(block + step);
  }
}

// Squared distances along a row to its nearest surface, for p = first .. first + out.size() - 1,
// which may lie beside the row.
void transform_row(const std::vector<char>& row, int first, int reach,
                   std::span<std::int16_t> out) {
  const int size = static_cast<int>(row.size()), end = first + static_cast<int>(out.size());
  const auto is_surface = [&](int p) {
    return p >= 0 && p < size && row[static_cast<std::size_t>(p)] != 0;
  };
  const auto at = [&](int p) -> std::int16_t& { return out[static_cast<std::size_t>(p - first)]; };
  int last = -kFarAway;
  for (int p = std::min(first, 0); p < end; ++p) {
    if (is_surface(p)) last = p;
    if (p >= first) at(p) = static_cast<std::int16_t>(std::min(p - last, kFarAway));
  }
  last = 2 * kFarAway;
  for (int p = std::max(end, size) - 1; p >= first; --p) {
    if (is_surface(p)) last = p;
    if (p >= end) continue;
    const int distance = std::min<int>(at(p), last - p);
    at(p) = distance > reach ? kNone : static_cast<std::int16_t>(distance * distance);
  }
}

// The transforms of a box of surface along x and y, layer by layer, and along z at each target.
class BoxTransform {
 public:
  BoxTransform(const SurfaceBox& box, int reach, std::span<const DistanceTarget> targets)
      : box_(box), reach_(reach), low_(targets.front().position), high_(low_) {
    for (const DistanceTarget& target : targets) {
      low_ = low_.cwiseMin(target.position);
      high_ = high_.cwiseMax(target.position);
    }
    const Eigen::Vector3i side = high_ - low_ + Eigen::Vector3i::Ones();
    columns_.resize(static_cast<std::size_t>(side.x()) * static_cast<std::size_t>(side.y()));
    width_ = side.x();
    for (const DistanceTarget& target : targets)
      columns_[column_of(target.position.x(), target.position.y())].assign(kBlockSide * voxels(2),
                                                                           kNoSurface);
    by_x_.resize(static_cast<std::size_t>(width_) * voxels(1));
    layer_used_.resize(static_cast<std::size_t>(box.blocks.z()));
  }

  void transform_layers() {
    for (int z = 0; z < static_cast<int>(voxels(2)); ++z)
      if (transform_rows(z)) {
        layer_used_[static_cast<std::size_t>(z / kBlockSide)] = 1;
        transform_columns(z);
      }
  }

  void write(const DistanceTarget& target) const {
    const int farthest = reach_ * reach_;
    const auto& column = columns_[column_of(target.position.x(), target.position.y())];
    for (int y = 0; y < kBlockSide; ++y) {
      const Tile tile =
          transform(std::span(column).subspan(static_cast<std::size_t>(y) * voxels(2), voxels(2)),
                    layer_used_, target.position.z() - box_.low.z(), reach_);
      for (int z = 0; z < kBlockSide; ++z)
        for (int x = 0; x < kBlockSide; ++x) {
          const int squared = tile[static_cast<std::size_t>(z)][static_cast<std::size_t>(x)];
          (*target.squared)[voxel_index(x, y, z)] =
              squared > farthest ? kBeyondReach : static_cast<std::uint16_t>(squared);
        }
    }
  }

 private:
  [[nodiscard]] std::size_t voxels(Eigen::Index axis) const {
    return static_cast<std::size_t>(box_.blocks[axis] * kBlockSide);
  }
  [[nodiscard]] std::size_t column_of(int x, int y) const {
    return static_cast<std::size_t>((y - low_.y()) * width_ + x - low_.x());
  }

  // Reads the surface of a row into `row_`. False if there is none.
  bool read_row(int y, int z) {
    bool has_surface = false;
    const std::size_t first = static_cast<std::size_t>(
        (z / kBlockSide * box_.blocks.y() + y / kBlockSide) * box_.blocks.x());
    for (std::size_t b = 0; b < static_cast<std::size_t>(box_.blocks.x()); ++b) {
      const std::uint64_t bits =
          box_.surface[first + b][static_cast<std::size_t>(z % kBlockSide)] >>
              (kBlockSide * (y % kBlockSide)) &
          0xFFU;
      has_surface |= bits != 0;
      for (std::size_t x = 0; x < kBlockSide; ++x)
        row_[b * kBlockSide + x] = static_cast<char>(bits >> x & 1U);
    }
    return has_surface;
  }

  // Transforms all rows of a layer along x, into `by_x_`. False without surface.
  bool transform_rows(int z) {
    row_.resize(voxels(0));
    row_used_.assign(static_cast<std::size_t>(box_.blocks.y()), 0);
    std::vector<std::int16_t> out(static_cast<std::size_t>(width_ * kBlockSide));
    bool any = false;
    for (int y = 0; y < static_cast<int>(voxels(1)); ++y) {
      if (!read_row(y, z)) continue;
      if (!any) std::ranges::fill(by_x_, kNoSurface);
      any = true;
      row_used_[static_cast<std::size_t>(y / kBlockSide)] = 1;
      transform_row(row_, (low_.x() - box_.low.x()) * kBlockSide, reach_, out);
      for (std::size_t b = 0; b < static_cast<std::size_t>(width_); ++b)
        std::copy_n(&out[b * kBlockSide], kBlockSide,
                    by_x_[b * voxels(1) + static_cast<std::size_t>(y)].begin());
    }
    return any;
  }

  // Transforms a layer along y, at the columns of the targets. Columns begin without surface.
  void transform_columns(int z) {
    for (int y = low_.y(); y <= high_.y(); ++y)
      for (int x = low_.x(); x <= high_.x(); ++x) {
        std::vector<Lanes>& column = columns_[column_of(x, y)];
        if (column.empty()) continue;
        const Tile tile = transform(
            std::span(by_x_).subspan(static_cast<std::size_t>(x - low_.x()) * voxels(1), voxels(1)),
            row_used_, y - box_.low.y(), reach_);
        for (std::size_t k = 0; k < kBlockSide; ++k)
          column[k * voxels(2) + static_cast<std::size_t>(z)] = tile[k];
      }
  }

  const SurfaceBox& box_;
  const int reach_;
  Eigen::Vector3i low_, high_;  // first and last block of the targets
  int width_ = 0;               // blocks of the targets along x
  std::vector<char> row_, row_used_, layer_used_;
  std::vector<Lanes> by_x_;  // One layer: [block along x][y].
  // One column for each block of the targets along x and y: [y within the block][z]; empty without
  // a target.
  std::vector<std::vector<Lanes>> columns_;
};

}  // namespace

void find_surface_distances(const SurfaceBox& box, int reach,
                            std::span<const DistanceTarget> targets) {
  if (targets.empty()) return;
  if (box.surface.empty()) {
    for (const DistanceTarget& target : targets) target.squared->fill(kBeyondReach);
    return;
  }
  BoxTransform transform(box, reach, targets);
  transform.transform_layers();
  for (const DistanceTarget& target : targets) transform.write(target);
}

}  // namespace km
