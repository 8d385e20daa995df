#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <unordered_set>
#include <vector>

#include "modules/mesh/grid_cell.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// The space near a set of points, in cubic cells. It contains everything within `reach_m` of a
/// point, and nothing further than 2 sqrt(3) reach_m. Queries are cheap; O(volume / reach^3)
/// memory.
class NearbyCells {
 public:
  /// Throws std::invalid_argument unless reach_m is positive and finite.
  explicit NearbyCells(double reach_m);

  void add(std::span<const Eigen::Vector3f> points);

  [[nodiscard]] bool contains(const Eigen::Vector3f& point) const;

  /// False only if nothing in the box is near. May be true for a large box without anything near.
  [[nodiscard]] bool may_touch(const Eigen::AlignedBox3f& box) const;

 private:
  [[nodiscard]] GridCell cell_of(const Eigen::Vector3f& point) const;

  double reach_m_;
  Eigen::AlignedBox3f bounds_;  // box of the points, enlarged by the reach
  std::unordered_set<GridCell, GridCellHash> cells_;
};

/// Points on a mesh, uniform by area.
struct SurfaceSamples {
  std::vector<Eigen::Vector3f> points;  ///< [m], in the mesh's frame.
  std::vector<std::uint32_t> faces;     ///< The face of each point.

  /// Number of samples of the whole mesh, including those that were not near or above the limit.
  std::size_t total = 0;
  /// Samples of `total` that are near; larger than points.size() if the limit was reached.
  std::size_t near = 0;
};

/// Area of all faces [m^2].
[[nodiscard]] double surface_area(const LabelledMesh& mesh);

/// Samples `per_m2` points per square metre. Their number is the area times per_m2, rounded up or
/// down. A face of area A has A per_m2 of them, also rounded up or down. With `only_near`, points
/// elsewhere are dropped. Points beyond max_points are counted but dropped. Equal arguments give
/// equal points; if the mesh moves, they move with it. O(faces + points).
[[nodiscard]] SurfaceSamples sample_surface(
    const LabelledMesh& mesh, double per_m2, std::uint32_t seed,
    const NearbyCells* only_near = nullptr,
    std::size_t max_points = std::numeric_limits<std::size_t>::max());

/// The nearest sample and face for a point.
struct NearestSample {
  std::uint32_t sample = 0;  ///< The nearest sample.
  float distance_m = 0.0F;   ///< Distance to it.

  /// The nearest of the faces of the nearest samples, and the distance to it. The distance is at
  /// most distance_m, has no lower limit from the spacing of samples, and is at least the distance
  /// to the mesh.
  std::uint32_t face = 0;
  float surface_m = 0.0F;
  bool past_boundary = false;  ///< The nearest point of that face is on the boundary of the mesh.
};

/// Finds the nearest of a mesh's samples in a k-d tree. Mesh and samples must outlive this object.
/// Const calls may run in parallel. Construction is O(n log n).
class NearestSurface {
 public:
  NearestSurface(const LabelledMesh& mesh, const SurfaceSamples& samples);
  ~NearestSurface();
  NearestSurface(NearestSurface&&) noexcept;
  NearestSurface& operator=(NearestSurface&&) noexcept;

  /// nullopt if no sample is nearer than `reach_m`.
  [[nodiscard]] std::optional<NearestSample> find(const Eigen::Vector3f& point,
                                                  double reach_m) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace km
