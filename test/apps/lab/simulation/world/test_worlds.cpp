#include "apps/lab/simulation/motion/road.hpp"
#include "apps/lab/simulation/rendering/ray_tracer.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/io/text_rows.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Eigen::AlignedBox3f;
using Eigen::Vector2d;
using Eigen::Vector3f;

using Classes = std::set<SurfaceClass>;
using Ways = std::vector<std::vector<Vector2d>>;

constexpr double kStep_m = 0.5;

// Checks with Catch2 that arrays go together, values are finite, normals of unit length, indices
// exist, and that no triangle lacks an area or turns away from its normals' mean.
void check_sound(const SurfaceMesh& mesh, std::size_t material_count) {
  const std::size_t n = mesh.vertices.size();
  REQUIRE(mesh.normals.size() == n);
  REQUIRE(mesh.uv.size() == n);
  REQUIRE(mesh.materials.size() == mesh.triangles.size());
  int not_finite = 0, normal_length = 0, index_range = 0, no_area = 0, winding = 0;
  for (std::size_t i = 0; i < n; ++i) {
    not_finite += !mesh.vertices[i].allFinite() || !mesh.uv[i].allFinite();
    normal_length += !(std::abs(mesh.normals[i].norm() - 1.0F) <= 1e-4F);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    if (std::max({a, b, c}) >= n || mesh.materials[i] >= material_count) {
      ++index_range;
      continue;
    }
    const Eigen::Vector3f cross =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    no_area += !(cross.norm() > 1e-8F);
    winding += cross.dot(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]) < 0.0F;
  }
  CHECK(not_finite == 0);
  CHECK(normal_length == 0);
  CHECK(index_range == 0);
  CHECK(no_area == 0);
  CHECK(winding == 0);
}

Classes classes_of(const World& world) {
  Classes classes;
  for (const std::uint16_t m : world.mesh.materials) classes.insert(world.materials[m].label);
  return classes;
}

void check_sound(const World& world) {
  check_sound(world.mesh, world.materials.size());
  for (const Material& material : world.materials) {
    CHECK(material.base < world.textures.size());
    CHECK(material.detail < world.textures.size());
    CHECK(material.label != SurfaceClass::kUnknown);
    CHECK(material.label != SurfaceClass::kSky);
    CHECK((material.tint.array() >= 0.0F).all());
  }
  CHECK(std::abs(world.lighting.to_sun.norm() - 1.0F) < 1e-5F);
}

bool equal(const World& a, const World& b) {
  const auto same_material = [](const Material& m, const Material& n) {
    return m.label == n.label && m.tint == n.tint && m.base == n.base;
  };
  const auto same_texture = [](const Texture& s, const Texture& t) {
    return s.mean_color() == t.mean_color();
  };
  const auto same_route = [](const Route& r, const Route& s) { return r.points == s.points; };
  return a.mesh.vertices == b.mesh.vertices && a.mesh.normals == b.mesh.normals &&
         a.mesh.triangles == b.mesh.triangles && a.mesh.materials == b.mesh.materials &&
         std::ranges::equal(a.materials, b.materials, same_material) &&
         std::ranges::equal(a.textures, b.textures, same_texture) &&
         std::ranges::equal(a.routes, b.routes, same_route);
}

/// Points every half metre along the route as it is driven: corners rounded by 5 m.
std::vector<Vector2d> driven_way(const Route& route) {
  const RoutePath path(route, 5.0);
  std::vector<Vector2d> points;
  for (double s = 0.0; s < path.length_m(); s += kStep_m) points.push_back(path.at(s).position);
  return points;
}

/// Share of `way` that passes within 5 m of `other`, and of that the share in the same direction.
struct Overlap {
  double share = 0.0, same_direction = 0.0;
};

Overlap overlap_of(const std::vector<Vector2d>& way, const std::vector<Vector2d>& other) {
  double near = 0.0, same = 0.0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Vector2d along = way[(i + 1) % way.size()] - way[i];
    bool is_near = false, is_same = false;
    for (std::size_t k = 0; k < other.size(); ++k) {
      if ((other[k] - way[i]).norm() > 5.0) continue;
      is_near = true;
      is_same |= along.dot(other[(k + 1) % other.size()] - other[k]) > 0.7 * kStep_m * kStep_m;
    }
    near += is_near;
    same += is_same;
  }
  return {near / static_cast<double>(way.size()), same / std::max(1.0, near)};
}

/// Number of rays with which a vehicle hits the world. Its front, 2.4 m wide, from 0.3 to 2.2 m
/// above the ground, moves from each point of the way to the next. Rays are 10 cm apart.
int obstacles_on(const World& world, const RayTracer& tracer, const std::vector<Vector2d>& way) {
  const auto at = [&](const Vector2d& p, double above) -> Vector3f {
    return Eigen::Vector3d(p.x(), p.y(), world.ground_height(p.x(), p.y()) + above).cast<float>();
  };
  int found = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Vector2d& a = way[i];
    const Vector2d& b = way[(i + 1) % way.size()];
    const Vector2d left = Vector2d(a.y() - b.y(), b.x() - a.x()).normalized();
    for (double up = 0.3; up < 2.2; up += 0.1) {
      for (double side = -1.2; side < 1.2; side += 0.1 * kLanes) {
        RayPacket rays;
        for (int lane = 0; lane < kLanes; ++lane) {
          const Vector2d offset = std::min(1.2, side + 0.1 * lane) * left;
          const Vector3f from = at(a + offset, up);
          set_ray(rays, lane, from, at(b + offset, up) - from, 0.0F, 1.0F);
        }
        found += tracer.occluded(kAllLanes, rays) != 0;
      }
    }
  }
  return found;
}

/// Greatest distance of the mesh's ground from ground_height below the points of `way` [m].
double ground_error_m(const World& world, const RayTracer& tracer,
                      const std::vector<Vector2d>& way) {
  constexpr float kAbove_m = 0.25F;
  float worst = 0.0F;
  for (const Vector2d& p : way) {
    const double ground = world.ground_height(p.x(), p.y());
    RayPacket rays;
    const Vector3f from = Eigen::Vector3d(p.x(), p.y(), ground).cast<float>();
    set_ray(rays, 0, from + kAbove_m * Vector3f::UnitZ(), -Vector3f::UnitZ(), 0.0F, 10.0F);
    tracer.intersect(1U, rays);
    worst = std::max(worst, std::abs(rays.ray.tfar[0] - kAbove_m));  // 10 m: no ground
  }
  return static_cast<double>(worst);
}

/// Checks the routes of a world with streets.
void check_routes(const World& world) {
  const RayTracer tracer(world.mesh);
  REQUIRE(world.routes.size() >= 3);
  Ways ways;
  for (const Route& route : world.routes) {
    CAPTURE(ways.size());
    const auto& way = ways.emplace_back(driven_way(route));
    CHECK(static_cast<double>(way.size()) * kStep_m > 300.0);
    CHECK((way.front() - way.back()).norm() < 2.0 * kStep_m);
    CHECK(route.speed_mps > 0.0);
    CHECK(ground_error_m(world, tracer, way) < 0.02);  // lane lines and manholes lie on the ground
    CHECK(obstacles_on(world, tracer, way) == 0);
  }
  for (std::size_t i = 0; i < ways.size(); ++i)
    for (std::size_t k = 0; k < ways.size(); ++k) {
      if (i == k) continue;
      CAPTURE(i, k);
      const double share = overlap_of(ways[i], ways[k]).share;
      CHECK(share > 0.1);
      CHECK(share < 0.9);
    }
  // Same direction between the first two, some of both between the first and the third.
  CHECK(overlap_of(ways[0], ways[1]).same_direction > 0.7);
  CHECK(overlap_of(ways[0], ways[2]).same_direction > 0.2);
  CHECK(overlap_of(ways[0], ways[2]).same_direction < 0.8);
}

void check_outdoors(World (*make)(std::uint64_t), const std::string& name,
                    const Classes& required) {
  const World one = make(1);
  const World other = make(2);
  CHECK(one.name == name);
  CHECK(equal(make(1), one));
  CHECK_FALSE(equal(other, one));
  for (const World* world : {&one, &other}) {
    CAPTURE(world == &one);
    check_sound(*world);
    CHECK(world->mesh.triangles.size() > 1000);
    CHECK(world->mesh.triangles.size() < 1'600'000);
    CHECK(std::ranges::includes(classes_of(*world), required));
    check_routes(*world);
  }
}

TEST_CASE("The city is sound, free of obstacles on its routes, and depends on the seed alone") {
  check_outdoors(
      make_city, "city",
      {SurfaceClass::kBuilding, SurfaceClass::kRoad, SurfaceClass::kSidewalk,
       SurfaceClass::kTerrain, SurfaceClass::kVegetation, SurfaceClass::kVehicle,
       SurfaceClass::kPole, SurfaceClass::kFence, SurfaceClass::kPerson, SurfaceClass::kObject});
}

TEST_CASE("The camp is sound, free of obstacles on its routes, and depends on the seed alone") {
  check_outdoors(make_camp, "camp",
                 {SurfaceClass::kRoad, SurfaceClass::kTerrain, SurfaceClass::kVegetation,
                  SurfaceClass::kVehicle, SurfaceClass::kPole, SurfaceClass::kFence,
                  SurfaceClass::kTent, SurfaceClass::kPerson, SurfaceClass::kObject});
}

using Corners = std::array<Vector3f, 3>;

Corners corners_of(const SurfaceMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
}

AlignedBox3f bounds(const Corners& t) {
  return AlignedBox3f(t[0]).extend(t[1]).extend(t[2]);
}

float distance(const Vector3f& p, const Corners& t) {
  const Vector3f n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  bool above = true;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3f& a = t[i];
    const Vector3f edge = t[(i + 1) % 3] - a;
    above = above && n.cross(edge).dot(p - a) >= 0.0F;
    const float share = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0F, 1.0F);
    nearest = std::min(nearest, (a + share * edge - p).norm());
  }
  return above ? std::abs(n.dot(p - t[0])) : nearest;
}

/// Positions of a recorded flight, one in `keep_every`; the file may be gzipped.
std::vector<Vector3f> flight(const fs::path& file, std::size_t keep_every) {
  const bool zipped = file.extension() == ".gz";
  const CommandResult text = run_command((zipped ? "gzip -dc " : "cat ") + file.string());
  REQUIRE(text.exit_code == 0);
  std::vector<Vector3f> positions;
  const std::vector<TextRow> rows = split_rows(text.output);
  for (std::size_t i = 0; i < rows.size(); i += keep_every) {
    Eigen::Vector3d p;
    for (std::size_t k = 0; k < 3; ++k)
      p[static_cast<Eigen::Index>(k)] = parse_double(rows[i].fields.at(k + 1)).value();
    positions.emplace_back(p.cast<float>());
  }
  return positions;
}

void append(std::vector<Vector3f>& positions, const std::vector<Vector3f>& more) {
  positions.insert(positions.end(), more.begin(), more.end());
}

/// Smallest distance of the positions to the surface, if it is at most 1 m.
float clearance_m(const World& world, const std::vector<Vector3f>& positions) {
  AlignedBox3f reach;
  for (const Vector3f& p : positions) reach.extend(p);
  reach = AlignedBox3f(reach.min() - Vector3f::Ones(), reach.max() + Vector3f::Ones());
  float nearest = 1.0F;
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const Corners t = corners_of(world.mesh, i);
    const AlignedBox3f box = bounds(t);
    if (!box.intersects(reach)) continue;
    for (const Vector3f& p : positions)
      if (box.squaredExteriorDistance(p) < nearest * nearest)
        nearest = std::min(nearest, distance(p, t));
  }
  return nearest;
}

TEST_CASE(
    "The Vicon room is sound, closed, lit by lamps, empty where flights are, and each seed's own") {
  const auto seed = GENERATE(range(1U, 5U));
  CAPTURE(seed);
  const World world = make_vicon_room(seed);
  check_sound(world);
  const AlignedBox3f room(Vector3f(-4.6F, -3.5F, 0.0F), Vector3f(3.4F, 4.5F, 4.0F));
  const Vector3f niche(0.2F, 0.2F, 0.02F);
  const AlignedBox3f with_niches(room.min() - niche, room.max() + niche);
  CHECK(std::ranges::all_of(world.mesh.vertices,
                            [&](const Vector3f& v) { return with_niches.contains(v); }));
  CHECK(classes_of(world) == Classes{SurfaceClass::kWall, SurfaceClass::kFloor,
                                     SurfaceClass::kCeiling, SurfaceClass::kFurniture,
                                     SurfaceClass::kCurtain, SurfaceClass::kObject});
  CHECK(world.lighting.sun == 0.0F);
  CHECK_FALSE(world.lighting.lamps.empty());
  for (const Lighting::Lamp& lamp : world.lighting.lamps) CHECK(room.contains(lamp.position));
  const AlignedBox3f volume = world.flight_volume.cast<float>();
  REQUIRE(volume.volume() > 50.0F);
  int inside = 0;
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i)
    inside += bounds(corners_of(world.mesh, i)).intersects(volume);
  CHECK(inside == 0);
  const RayTracer tracer(world.mesh);
  SeededRandom random(seed);
  for (int packet = 0; packet < 20; ++packet) {
    RayPacket rays;
    for (int lane = 0; lane < kLanes; ++lane) {
      const float z = random.uniform(-1.0F, 1.0F);
      const float angle = random.uniform(0.0F, 6.2832F);
      const float r = std::sqrt(1.0F - z * z);
      set_ray(rays, lane, volume.center(), {r * std::cos(angle), r * std::sin(angle), z}, 0.0F,
              100.0F);
    }
    CHECK(tracer.occluded(kAllLanes, rays) == kAllLanes);
  }
  if (seed > 1) return;
  CHECK(equal(make_vicon_room(1), world));
  CHECK_FALSE(equal(make_vicon_room(5), world));
}

TEST_CASE("The recorded flights stay clear of everything in the Vicon room") {
  const auto euroc = shared_data("euroc");
  if (!euroc) return;
  // 20 to 200 rows a second at up to 2.5 m/s: no flight gets 3 cm nearer between two samples.
  std::vector<Vector3f> positions =
      flight(*euroc / "V1_01_easy/mav0/state_groundtruth_estimate0/data.csv", 1);
  for (const std::string name :
       {"V1_02_medium", "V1_03_difficult", "V2_01_easy", "V2_02_medium", "V2_03_difficult"})
    append(positions, flight(*euroc / ("groundtruth_only/" + name + ".csv.gz"), 4));
  REQUIRE(positions.size() > 20000);
  for (const std::uint64_t seed : {1, 4}) {
    CAPTURE(seed);
    CHECK(clearance_m(make_vicon_room(seed), positions) >= 0.25F);
  }
}

using Eigen::Vector2f;

double area_m2(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    area += 0.5 *
            (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  return area;
}

/// Volume inside a closed mesh, positive if its triangles face outwards (divergence theorem).
double volume_m3(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6.0;
  return volume;
}

TEST_CASE("Closed shapes face outwards and have the volume and area of the solid") {
  Scene scene;
  double volume = 0.0;
  double area = 0.0;
  double tolerance = 1e-4;  // float
  SECTION("box") {
    scene.box({1, 2, 3}, {3, 5, 7}, 0);
    volume = 24.0;
    area = 52.0;
  }
  SECTION("prism over a house's front") {
    const Vector2f outline[] = {{0, 0}, {8, 0}, {8, 3}, {4, 6}, {0, 3}};
    scene.extrude(outline, -1.0F, 1.0F, 1);
    volume = 2.0 * 36.0;
    area = 2.0 * 36.0 + 2.0 * 24.0;
  }
  SECTION("cylinder") {
    scene.cylinder({1, 1, 1}, {1, 3, 1}, 0.5F, 0.5F, 64, 0);
    volume = std::numbers::pi * 0.25 * 2.0;
    area = std::numbers::pi * (2.0 * 0.25 + 2.0);
    tolerance = 0.004;  // a polygon of 64 corners
  }
  SECTION("cone") {
    scene.cylinder({0, 0, 0}, {0, 0, 3}, 1.0F, 0.0F, 64, 0);
    volume = std::numbers::pi;
    area = std::numbers::pi * (1.0 + std::sqrt(10.0));
    tolerance = 0.004;
  }
  SECTION("ellipsoid") {
    scene.ellipsoid({0, 1, 2}, {1, 1, 1}, 96, 0);
    volume = 4.0 / 3.0 * std::numbers::pi;
    area = 4.0 * std::numbers::pi;
    tolerance = 0.004;
  }
  SECTION("revolved profile") {
    const Vector2f profile[] = {{0, 0}, {1, 0}, {1, 2}, {0, 2}};
    scene.revolve(profile, 96, 0);
    volume = 2.0 * std::numbers::pi;
    area = 6.0 * std::numbers::pi;
    tolerance = 0.004;
  }
  check_sound(scene.mesh(), 3);
  CHECK(volume_m3(scene.mesh()) == Approx(volume).epsilon(tolerance));
  CHECK(area_m2(scene.mesh()) == Approx(area).epsilon(tolerance));
}

}  // namespace
}  // namespace km
