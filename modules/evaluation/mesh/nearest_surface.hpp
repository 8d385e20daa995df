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
  bool past_rim = false;  ///< The nearest point of that face lies where the mesh ends.
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

/// The point of a triangle that is nearest to another.
struct TrianglePoint {
  double distance_m = 0.0;
  int edge = -1;    ///< It lies between corners `edge` and `edge` + 1 (of 3), or
  int corner = -1;  ///< on this corner; both -1: inside.
};

/// Of the triangle a, b, c, which may be degenerate.
[[nodiscard]] TrianglePoint nearest_on_triangle(const Eigen::Vector3d& point,
                                                const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                                const Eigen::Vector3d& c);

}  // namespace km
