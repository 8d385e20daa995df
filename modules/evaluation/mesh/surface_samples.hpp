#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "modules/evaluation/mesh/nearby_cells.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Points on a mesh, uniform by area.
struct SurfaceSamples {
  std::vector<Eigen::Vector3f> points;  ///< [m], in the mesh's frame.
  std::vector<std::uint32_t> faces;     ///< The face each lies on.

  /// Points there were to be, among them those that were not near or above the limit.
  std::size_t total = 0;
  std::size_t near = 0;  ///< Of `total`, those near; above points.size() if the limit was met.
};

/// Area of all faces [m^2].
[[nodiscard]] double surface_area(const LabelledMesh& mesh);

/// Samples `per_m2` points per square metre: their number is the area times per_m2, rounded up or
/// down, and a face of area A has A per_m2 of them, likewise. With `only_near`, those elsewhere are
/// left out. Beyond max_points they are counted, but not kept. The same arguments give the same
/// points; moving the mesh moves them along. O(faces + points).
[[nodiscard]] SurfaceSamples sample_surface(
    const LabelledMesh& mesh, double per_m2, std::uint32_t seed,
    const NearbyCells* only_near = nullptr,
    std::size_t max_points = std::numeric_limits<std::size_t>::max());

}  // namespace km
