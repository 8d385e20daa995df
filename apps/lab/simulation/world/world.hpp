#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/lab/simulation/world/texture.hpp"
#include "modules/core/map/label_palette.hpp"

namespace km {

/// Semantic classes of the built-in worlds; the values are the ids in label images and meshes.
enum class SurfaceClass : LabelId {
  kUnknown = 0,
  kSky,
  kBuilding,
  kRoad,
  kSidewalk,
  kTerrain,
  kVegetation,
  kVehicle,
  kPole,  ///< Poles, lamps and signs.
  kFence,
  kTent,  ///< Tents and shelters.
  kPerson,
  kWall,
  kFloor,
  kCeiling,
  kFurniture,
  kCurtain,
  kObject,
};

/// Names and colours of SurfaceClass.
[[nodiscard]] const LabelPalette& simulation_palette();

/// Triangles of the whole world, frame `world`: metres, z up. No vertex is shared between triangles
/// that meet at an edge which shall look sharp. Leaves are single triangles, seen from both sides.
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices;                ///< [m]
  std::vector<Eigen::Vector3f> normals;                 ///< Per vertex, unit length.
  std::vector<Eigen::Vector2f> uv;                      ///< Per vertex, along the surface [m].
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Counter-clockwise seen from outside.
  std::vector<std::uint16_t> materials;  ///< Per triangle: index into World::materials.
};

/// Part of a mesh that is one thing, like a vehicle or a chair.
struct WorldObject {
  std::size_t first_triangle = 0, end_triangle = 0;  ///< Range of SurfaceMesh::triangles.
  float yaw_rad = 0.0F;                              ///< Heading of its x axis about z.
};

/// How a surface looks: albedo = tint * base(uv / base_period) * detail(uv / detail_period), where
/// the two periods are incommensurate, so that the pattern of the base is not seen to repeat.
/// Textures are indices into World::textures; a detail is mid-grey on average and scaled by two.
struct Material {
  SurfaceClass label = SurfaceClass::kUnknown;
  Eigen::Vector3f tint = Eigen::Vector3f::Ones();  ///< Linear RGB.
  std::uint16_t base = 0;
  std::uint16_t detail = 0;
  float base_period_m = 4.0F;    ///< Edge of one tile of `base` on the surface [m].
  float detail_period_m = 1.0F;  ///< Edge of one tile of `detail` [m].
  float specular = 0.0F;         ///< Share of mirrored sky, 0 to 1 (windows, car paint).
  float glow = 0.0F;             ///< Light it sends out by itself, as if it got so much irradiance
                                 ///< more (lamps, screens, curtains before a window).

  bool operator==(const Material&) const = default;
};

/// Lights of a world: the sun and the sky outdoors, lamps and a constant ambient term indoors.
struct Lighting {
  struct Lamp {
    Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< [m]
    float intensity = 1.0F;                              ///< Irradiance at 1 m, sun = 1.
  };
  Eigen::Vector3f to_sun = Eigen::Vector3f::UnitZ();  ///< Unit vector towards the sun.
  float sun = 0.0F;                                   ///< Irradiance of a surface facing it.
  float ambient = 0.3F;                               ///< Irradiance from an open sky or room.
  std::vector<Lamp> lamps;
  float haze_distance_m = 0.0F;  ///< Distance at which contrast falls to 1/e; 0: clear air.
};

inline constexpr float kLanesApart_m = 3.2F;  ///< Distance between the middles of two lanes.

/// A closed way along which vehicles drive, centre line of their lane in driving direction, right
/// hand traffic. The last point joins the first.
struct Route {
  std::vector<Eigen::Vector2d> points;  ///< In the world's xy plane [m], corners unrounded.
  double speed_mps = 6.0;               ///< Speed on straights.
};

/// A procedural world. Pure data: equal for equal (name, seed), whatever the machine's thread
/// count.
struct World {
  std::string name;
  SurfaceMesh mesh;
  std::vector<WorldObject> objects;  ///< Ascending, without overlap.
  std::vector<Material> materials;
  std::vector<Texture> textures;
  Lighting lighting;

  /// Height of drivable ground below (x, y) [m]. Null indoors.
  std::function<double(double, double)> ground_height;
  /// Robot r drives along routes[r % routes.size()]. Routes overlap in part, some in the same and
  /// some in the opposite direction, and each has loops of its own. Empty indoors.
  std::vector<Route> routes;
  /// Volume for flying robots, free of obstacles [m]. Empty outdoors.
  Eigen::AlignedBox3d flight_volume;
};

/// Blocks of facades, streets with markings, parked vehicles, trees, lamps, signs, fences, people.
[[nodiscard]] World make_city(std::uint64_t seed);

/// Rough terrain with tents, containers, vehicles, fences, trees and people.
[[nodiscard]] World make_camp(std::uint64_t seed);

/// A room of 8 x 8 x 4 m with mats, curtains, furniture and clutter. Its frame is EuRoC's Vicon
/// frame: the recorded flights of V1 and V2 stay clear of everything in it.
[[nodiscard]] World make_vicon_room(std::uint64_t seed);

/// The closed way `right_m` to the right of the closed centre line through `nodes` in driving
/// direction, both without rounded corners. Nodes may be visited more than once. Preconditions: at
/// least three nodes, no two neighbours at one place, no turn back.
[[nodiscard]] std::vector<Eigen::Vector2d> right_hand_lane(std::span<const Eigen::Vector2d> nodes,
                                                           double right_m);

/// The route in the opposite direction, on the lane to the left of `route`.
[[nodiscard]] Route opposite_route(const Route& route);

/// Four closed routes over a grid of crossings at columns `x` and rows `y` [m], `right_m` to the
/// right of the middle. They begin between their first and second crossing, whose weights are
/// `start`. The second route follows the first from one street behind over three streets. The third
/// meets both in the opposite direction first, and follows them on the street on which both begin.
/// The fourth follows the second and the third. Each returns to a street of its own, in the same
/// direction, after one block. Precondition: at least 4 columns and 3 rows.
[[nodiscard]] std::vector<Route> crossing_routes(std::span<const float> x, std::span<const float> y,
                                                 const std::array<double, 2>& start, double right_m,
                                                 double speed_mps);

}  // namespace km
