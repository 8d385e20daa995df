#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "modules/evaluation/mesh/surface_samples.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// What is nearest to a point.
struct NearestSample {
  std::uint32_t sample = 0;  ///< The nearest sample.
  float distance_m = 0.0F;   ///< To it.

  /// The nearest of the faces that the nearest few samples lie on, and the distance to it: at most
  /// distance_m, and free of the floor that the spacing of samples sets. Not below the distance to
  /// the mesh.
  std::uint32_t face = 0;
  float surface_m = 0.0F;
};

/// Finds the nearest of a mesh's samples in a k-d tree. Mesh and samples outlive this. Const calls
/// may run in parallel. Building is O(n log n).
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

/// Distance from `point` to the triangle a, b, c, which may be degenerate [m].
[[nodiscard]] double distance_to_triangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                          const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace km
