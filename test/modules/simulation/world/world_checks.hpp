#pragma once

#include <Eigen/Core>
#include <set>
#include <vector>

#include "modules/simulation/world/world.hpp"

namespace km {

/// What can be wrong with a mesh, counted.
struct MeshFaults {
  std::size_t not_finite = 0;     ///< Vertices, normals or texture coordinates.
  std::size_t normal_length = 0;  ///< Normals that are not of unit length.
  std::size_t index_range = 0;    ///< Triangles with an index or a material that does not exist.
  std::size_t no_area = 0;
  std::size_t winding = 0;  ///< Triangles that turn away from all three normals' mean.
  std::size_t sizes = 0;    ///< Arrays whose lengths do not go together.
};
[[nodiscard]] MeshFaults faults_of(const SurfaceMesh& mesh, std::size_t material_count);

/// Checks with Catch2 that there is no fault and that every material and texture exists.
void check_sound(const World& world);

/// A number that differs, in all likelihood, when any byte of geometry, materials, textures' sizes
/// or routes does.
[[nodiscard]] std::uint64_t fingerprint(const World& world);

[[nodiscard]] std::set<SurfaceClass> classes_of(const World& world);

/// Points every half metre along the route as it is driven: corners rounded by 5 m.
[[nodiscard]] std::vector<Eigen::Vector2d> driven_way(const Route& route);

/// Share of `way` that passes within `near_m` of `other`, and of that the share in the same
/// direction.
struct Overlap {
  double share = 0.0;
  double same_direction = 0.0;
};
[[nodiscard]] Overlap overlap_of(const std::vector<Eigen::Vector2d>& way,
                                 const std::vector<Eigen::Vector2d>& other, double near_m);

/// Corners and inner points of triangles that are no ground and stand in the way of a vehicle.
[[nodiscard]] std::vector<Eigen::Vector3f> obstacles_near(const World& world,
                                                          const std::vector<Eigen::Vector2d>& way,
                                                          double half_width_m);

/// Greatest distance of the mesh's ground from ground_height below the points of `way` [m];
/// infinite where there is no ground.
[[nodiscard]] double ground_error_m(const World& world, const std::vector<Eigen::Vector2d>& way);

/// Checks with Catch2 all that holds for the routes of a world to drive in.
void check_routes(const World& world);

}  // namespace km
