#include "modules/map_2d/surface_columns.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace km {
namespace {

constexpr double kLeast_up = 0.82;         // cosine of 35 degrees
constexpr int kSteps = 32000;              // bound on SurfaceLayer::step
constexpr double kUnit_m2 = 1e-7;          // unit in which areas are summed
constexpr std::size_t kBatch = 1U << 21U;  // entries after which equal ones are summed

// A layer under a key that sorts by cell, height and kind.
struct Entry {
  std::uint64_t key = 0;
  std::uint64_t area = 0;  // [kUnit_m2]
};

constexpr std::uint64_t kKinds = 4, kHeights = 1U << 16U;

std::uint64_t key_of(std::uint32_t cell, int step, SurfaceKind kind) {
  return (cell * kHeights + static_cast<std::uint64_t>(step + kSteps)) * kKinds +
         static_cast<std::uint64_t>(kind);
}

void sum_equal(std::vector<Entry>& entries) {
  std::ranges::sort(entries, {}, &Entry::key);
  std::size_t kept = 0;
  for (const Entry& entry : entries) {
    if (kept > 0 && entries[kept - 1].key == entry.key)
      entries[kept - 1].area += entry.area;
    else
      entries[kept++] = entry;
  }
  entries.resize(kept);
}

Eigen::AlignedBox2d extent_of(const LabelledMesh& mesh) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    if (vertex.allFinite()) box.extend(Eigen::Vector2d(vertex.head<2>().cast<double>()));
  return box;
}

// Collects the samples of faces.
class Sampler {
 public:
  Sampler(const LabelledMesh& mesh, const CellGrid& grid, const std::array<bool, 256>& is_floor)
      : mesh_(mesh), grid_(grid), is_floor_(is_floor) {}

  void add(std::size_t face) {
    const auto& corners = mesh_.faces[face];
    const Eigen::Vector3d a = mesh_.vertices[corners[0]].cast<double>();
    const Eigen::Vector3d ab = mesh_.vertices[corners[1]].cast<double>() - a;
    const Eigen::Vector3d ac = mesh_.vertices[corners[2]].cast<double>() - a;
    const Eigen::Vector3d normal = ab.cross(ac);
    const double area_m2 = normal.norm() / 2;
    if (!(area_m2 > 0.0) || !std::isfinite(area_m2)) return;
    const LabelId label = mesh_.face_label(face);
    const SurfaceKind kind = is_floor_[label]                       ? SurfaceKind::kFloor
                             : normal.z() < kLeast_up * 2 * area_m2 ? SurfaceKind::kOther
                             : label == 0                           ? SurfaceKind::kLevel
                                                                    : SurfaceKind::kTop;
    const double longest_m =
        std::sqrt(std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()}));
    const int n = static_cast<int>(std::min(std::ceil(longest_m / grid_.resolution_m), 1000.0));
    const auto share = static_cast<std::uint64_t>(std::lround(area_m2 / (n * n) / kUnit_m2));
    // The centres of the n^2 triangles into which the face is divided.
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        sample(a + ((i + 1.0 / 3) * ab + (j + 1.0 / 3) * ac) / n, kind, share);
        if (i + j < n - 1) sample(a + ((i + 2.0 / 3) * ab + (j + 2.0 / 3) * ac) / n, kind, share);
      }
    if (entries_.size() > kBatch + summed_) {
      sum_equal(entries_);
      summed_ = entries_.size();
    }
  }

  std::vector<Entry> take() {
    sum_equal(entries_);
    return std::move(entries_);
  }

 private:
  void sample(const Eigen::Vector3d& point, SurfaceKind kind, std::uint64_t area) {
    const double step = std::round(point.z() / SurfaceColumns::kStep_m);
    if (!(std::abs(step) < kSteps)) return;
    const Eigen::Vector2d cell =
        ((point.head<2>() - grid_.origin) / grid_.resolution_m).array().floor();
    const int x = static_cast<int>(cell.x()), y = static_cast<int>(cell.y());
    if (grid_.contains(x, y))
      entries_.push_back({key_of(grid_.index(x, y), static_cast<int>(step), kind), area});
  }

  const LabelledMesh& mesh_;
  const CellGrid& grid_;
  const std::array<bool, 256>& is_floor_;
  std::vector<Entry> entries_;
  std::size_t summed_ = 0;
};

}  // namespace

Eigen::Vector2d cells_needed(const LabelledMesh& mesh, double resolution_m) {
  const Eigen::AlignedBox2d box = extent_of(mesh);
  if (box.isEmpty()) return Eigen::Vector2d::Zero();
  return (box.max() / resolution_m).array().floor() - (box.min() / resolution_m).array().floor() +
         1.0;
}

CellGrid grid_over(const LabelledMesh& mesh, double resolution_m) {
  const Eigen::Vector2d cells = cells_needed(mesh, resolution_m);
  CellGrid grid{.resolution_m = resolution_m,
                .width = static_cast<int>(cells.x()),
                .height = static_cast<int>(cells.y())};
  if (grid.size() > 0)
    grid.origin = (extent_of(mesh).min() / resolution_m).array().floor() * resolution_m;
  return grid;
}

SurfaceColumns::SurfaceColumns(const LabelledMesh& mesh, const CellGrid& grid,
                               const std::array<bool, 256>& is_floor)
    : grid_(grid), first_(grid.size() + 1, 0) {
  Sampler sampler(mesh, grid, is_floor);
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) sampler.add(face);
  const std::vector<Entry> entries = sampler.take();
  layers_.reserve(entries.size());
  for (const Entry& entry : entries) {
    const auto kind = static_cast<SurfaceKind>(entry.key % kKinds);
    const double area_m2 = kUnit_m2 * static_cast<double>(entry.area);
    layers_.push_back(
        {static_cast<std::int16_t>(static_cast<int>(entry.key / kKinds % kHeights) - kSteps), kind,
         static_cast<float>(area_m2)});
    areas_[static_cast<std::size_t>(kind)] += area_m2;
    ++first_[entry.key / kKinds / kHeights + 1];
  }
  for (std::size_t cell = 0; cell < grid_.size(); ++cell) first_[cell + 1] += first_[cell];
}

}  // namespace km
