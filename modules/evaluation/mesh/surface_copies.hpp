#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Options of compare_copies().
struct SurfaceCopiesOptions {
  double samples_per_m2 = 400.0;
  /// Largest distance of two copies of one surface [m]. Surfaces further apart count as two.
  double reach_m = 0.3;
  std::uint32_t seed = 1;
};

/// Distances between two robots' copies of the surface that both have mapped.
struct SurfaceCopies {
  std::size_t points = 0;  ///< Samples of both meshes that have a copy.
  double shared = 0.0;     ///< Their share in all samples.
  /// Distance along the normal from a sample to the other copy [m]; NaN without points.
  double median_m = 0.0;
  double p95_m = 0.0;
  /// The median after the rigid motion of one mesh by ICP [m]. The rest is noise and deformation of
  /// the meshes, which no relative pose of the robots can remove.
  double median_aligned_m = 0.0;
};

/// Compares the meshes of two robots in one frame. Each sample of a mesh is paired with the nearest
/// face of the other one within reach. The pair counts if the normals are within 60 degrees. The
/// two sides of a wall are therefore two surfaces. A pair does not count if the nearest point is on
/// a border of the other mesh, because only one robot saw the surface beyond it.
///
/// nullopt if a mesh has no faces. Equal arguments give equal results.
[[nodiscard]] std::optional<SurfaceCopies> compare_copies(const LabelledMesh& a,
                                                          const LabelledMesh& b,
                                                          const SurfaceCopiesOptions& options = {});

}  // namespace km
