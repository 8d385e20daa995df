#include "test/modules/simulation/world/world_checks.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "modules/simulation/motion/route_path.hpp"

namespace km {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

constexpr double kStep_m = 0.5;

bool is_ground(SurfaceClass label) {
  return label == SurfaceClass::kRoad || label == SurfaceClass::kSidewalk ||
         label == SurfaceClass::kTerrain;
}

template <typename T>
void hash_bytes(std::uint64_t& hash, const std::vector<T>& values) {
  const std::string_view bytes(reinterpret_cast<const char*>(values.data()),
                               values.size() * sizeof(T));
  hash = hash * 1099511628211U + std::hash<std::string_view>{}(bytes);
}

/// Distances from a way of points kStep_m apart: every cell of a grid knows the points near it.
class NearWay {
 public:
  explicit NearWay(const std::vector<Vector2d>& way) : way_(way) {
    for (const Vector2d& p : way) {
      low_ = low_.cwiseMin(p);
      high_ = high_.cwiseMax(p);
    }
    low_.array() -= kReach_m + kCell_m;
    high_.array() += kReach_m + kCell_m;
    columns_ = static_cast<std::size_t>((high_.x() - low_.x()) / kCell_m) + 1;
    cells_.resize(columns_ * (static_cast<std::size_t>((high_.y() - low_.y()) / kCell_m) + 1));
    for (std::size_t i = 0; i < way.size(); ++i) {
      for (double dx = -kReach_m; dx <= kReach_m; dx += kCell_m) {
        for (double dy = -kReach_m; dy <= kReach_m; dy += kCell_m) {
          cells_[cell(way[i] + Vector2d(dx, dy))].push_back(i);
        }
      }
    }
  }

  /// Infinite where it is more than kReach_m.
  [[nodiscard]] double distance(const Vector3f& p) const {
    const Vector2d q = p.head<2>().cast<double>();
    double least = std::numeric_limits<double>::infinity();
    if ((q.array() < low_.array()).any() || (q.array() > high_.array()).any()) return least;
    for (const std::size_t i : cells_[cell(q)]) {
      const Vector2d ab = way_[(i + 1) % way_.size()] - way_[i];
      const double share = std::clamp((q - way_[i]).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (q - way_[i] - share * ab).norm());
    }
    return least;
  }

  static constexpr double kReach_m = 3.0;

 private:
  static constexpr double kCell_m = 0.5;

  [[nodiscard]] std::size_t cell(const Vector2d& p) const {
    return static_cast<std::size_t>((p.y() - low_.y()) / kCell_m) * columns_ +
           static_cast<std::size_t>((p.x() - low_.x()) / kCell_m);
  }

  const std::vector<Vector2d>& way_;
  Vector2d low_ = Vector2d::Constant(1e9);
  Vector2d high_ = Vector2d::Constant(-1e9);
  std::size_t columns_ = 0;
  std::vector<std::vector<std::size_t>> cells_;
};

float longest_side(const std::array<Vector3f, 3>& t) {
  return std::max({(t[0] - t[1]).norm(), (t[1] - t[2]).norm(), (t[2] - t[0]).norm()});
}

/// Calls `visit` at the corners of a triangle and at points inside it not 0.4 m apart; pieces away
/// from the way are left out.
template <typename Visit>
void for_points_near(const NearWay& near, const std::array<Vector3f, 3>& t, const Visit& visit) {
  const float longest = longest_side(t);
  if (longest < NearWay::kReach_m - 1.5 && !std::isfinite(near.distance(t[0]))) return;
  if (longest < 0.4F) {
    for (const Vector3f& p : t) visit(p);
    return;
  }
  const std::array<Vector3f, 3> m = {0.5F * (t[0] + t[1]), 0.5F * (t[1] + t[2]),
                                     0.5F * (t[2] + t[0])};
  for_points_near(near, {t[0], m[0], m[2]}, visit);
  for_points_near(near, {m[0], t[1], m[1]}, visit);
  for_points_near(near, {m[2], m[1], t[2]}, visit);
  for_points_near(near, {m[0], m[1], m[2]}, visit);
}

}  // namespace

MeshFaults faults_of(const SurfaceMesh& mesh, std::size_t material_count) {
  MeshFaults faults;
  const std::size_t n = mesh.vertices.size();
  faults.sizes = static_cast<std::size_t>(mesh.normals.size() != n) +
                 static_cast<std::size_t>(mesh.uv.size() != n) +
                 static_cast<std::size_t>(mesh.materials.size() != mesh.triangles.size());
  if (faults.sizes != 0) return faults;
  for (std::size_t i = 0; i < n; ++i) {
    const bool finite =
        mesh.vertices[i].allFinite() && mesh.normals[i].allFinite() && mesh.uv[i].allFinite();
    faults.not_finite += static_cast<std::size_t>(!finite);
    faults.normal_length +=
        static_cast<std::size_t>(std::abs(mesh.normals[i].norm() - 1.0F) > 1e-4F);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    if (std::max({a, b, c}) >= n || mesh.materials[i] >= material_count) {
      ++faults.index_range;
      continue;
    }
    const Vector3f cross =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    const Vector3f mean = mesh.normals[a] + mesh.normals[b] + mesh.normals[c];
    faults.no_area += static_cast<std::size_t>(!(cross.norm() > 1e-8F));
    faults.winding += static_cast<std::size_t>(cross.dot(mean) < 0.0F);
  }
  return faults;
}

void check_sound(const World& world) {
  const MeshFaults faults = faults_of(world.mesh, world.materials.size());
  CHECK(world.mesh.triangles.size() > 1000);
  CHECK(faults.sizes == 0);
  CHECK(faults.not_finite == 0);
  CHECK(faults.normal_length == 0);
  CHECK(faults.index_range == 0);
  CHECK(faults.no_area == 0);
  CHECK(faults.winding == 0);
  for (const Material& material : world.materials) {
    CHECK(material.base < world.textures.size());
    CHECK(material.detail < world.textures.size());
    CHECK(material.label != SurfaceClass::kUnknown);
    CHECK(material.label != SurfaceClass::kSky);
    CHECK((material.tint.array() >= 0.0F).all());
  }
  CHECK(std::abs(world.lighting.to_sun.norm() - 1.0F) < 1e-5F);
}

std::uint64_t fingerprint(const World& world) {
  std::uint64_t hash = 1469598103934665603U;
  hash_bytes(hash, world.mesh.vertices);
  hash_bytes(hash, world.mesh.normals);
  hash_bytes(hash, world.mesh.uv);
  hash_bytes(hash, world.mesh.triangles);
  hash_bytes(hash, world.mesh.materials);
  for (const Route& route : world.routes) hash_bytes(hash, route.points);
  for (const Material& m : world.materials) {
    hash_bytes(hash, std::vector<float>{m.tint.x(), m.tint.y(), m.tint.z(), m.base_period_m,
                                        m.detail_period_m, m.specular, static_cast<float>(m.base),
                                        static_cast<float>(m.detail), static_cast<float>(m.label)});
  }
  for (const Texture& texture : world.textures) {
    hash_bytes(hash, std::vector<Eigen::Vector3f>{texture.color({0.37F, 0.61F}, 0.0F)});
  }
  return hash;
}

std::set<SurfaceClass> classes_of(const World& world) {
  std::set<SurfaceClass> classes;
  for (const std::uint16_t material : world.mesh.materials) {
    classes.insert(world.materials[material].label);
  }
  return classes;
}

std::vector<Vector2d> driven_way(const Route& route) {
  const RoutePath path(route, 5.0);
  std::vector<Vector2d> points;
  for (double s = 0.0; s < path.length_m(); s += kStep_m) points.push_back(path.at(s).position);
  return points;
}

Overlap overlap_of(const std::vector<Vector2d>& way, const std::vector<Vector2d>& other,
                   double near_m) {
  std::size_t near = 0;
  std::size_t same = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Vector2d along = way[(i + 1) % way.size()] - way[i];
    bool is_near = false;
    bool is_same = false;
    for (std::size_t k = 0; k < other.size(); ++k) {
      if ((other[k] - way[i]).norm() > near_m) continue;
      is_near = true;
      is_same |= along.dot(other[(k + 1) % other.size()] - other[k]) > 0.7 * kStep_m * kStep_m;
    }
    near += static_cast<std::size_t>(is_near);
    same += static_cast<std::size_t>(is_same);
  }
  return {static_cast<double>(near) / static_cast<double>(way.size()),
          static_cast<double>(same) / static_cast<double>(std::max<std::size_t>(1, near))};
}

std::vector<Vector3f> obstacles_near(const World& world, const std::vector<Vector2d>& way,
                                     double half_width_m) {
  const NearWay near(way);
  std::vector<Vector3f> found;
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    if (is_ground(world.materials[world.mesh.materials[i]].label)) continue;
    const auto& [a, b, c] = world.mesh.triangles[i];
    const std::array<Vector3f, 3> triangle = {world.mesh.vertices[a], world.mesh.vertices[b],
                                              world.mesh.vertices[c]};
    for_points_near(near, triangle, [&](const Vector3f& p) {
      if (near.distance(p) >= half_width_m) return;
      const double above = p.z() - world.ground_height(p.x(), p.y());
      if (above > 0.3 && above < 2.2) found.push_back(p);
    });
  }
  return found;
}

double ground_error_m(const World& world, const std::vector<Vector2d>& way) {
  std::vector<double> top(way.size(), -std::numeric_limits<double>::infinity());
  const NearWay near(way);
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    if (!is_ground(world.materials[world.mesh.materials[i]].label)) continue;
    const auto& [ia, ib, ic] = world.mesh.triangles[i];
    const Eigen::Vector3d a = world.mesh.vertices[ia].cast<double>();
    // Triangles below a way are smaller than the reach.
    if (!std::isfinite(near.distance(world.mesh.vertices[ia]))) continue;
    const Eigen::Vector3d ab = world.mesh.vertices[ib].cast<double>() - a;
    const Eigen::Vector3d ac = world.mesh.vertices[ic].cast<double>() - a;
    const double area = ab.x() * ac.y() - ab.y() * ac.x();
    if (std::abs(area) < 1e-9) continue;
    for (std::size_t k = 0; k < way.size(); ++k) {
      const Vector2d d = way[k] - a.head<2>();
      const double v = (d.x() * ac.y() - d.y() * ac.x()) / area;
      const double w = (ab.x() * d.y() - ab.y() * d.x()) / area;
      if (v < 0.0 || w < 0.0 || v + w > 1.0) continue;
      top[k] = std::max(top[k], a.z() + v * ab.z() + w * ac.z());
    }
  }
  double worst = 0.0;
  for (std::size_t k = 0; k < way.size(); ++k) {
    worst = std::max(worst, std::abs(top[k] - world.ground_height(way[k].x(), way[k].y())));
  }
  return worst;
}

void check_routes(const World& world) {
  constexpr double kVehicleHalfWidth_m = 1.2;
  constexpr double kPaint_m = 0.02;  // lane lines and manholes lie on the ground
  constexpr double kSameStreet_m = 5.0;
  REQUIRE(world.routes.size() >= 3);
  std::vector<std::vector<Vector2d>> ways;
  for (const Route& route : world.routes) {
    ways.push_back(driven_way(route));
    CAPTURE(ways.size());
    CHECK(static_cast<double>(ways.back().size()) * kStep_m > 300.0);
    CHECK((ways.back().front() - ways.back().back()).norm() < 2.0 * kStep_m);
    CHECK(route.speed_mps > 0.0);
    CHECK(ground_error_m(world, ways.back()) < kPaint_m);
    const std::vector<Vector3f> obstacles = obstacles_near(world, ways.back(), kVehicleHalfWidth_m);
    const Vector3f example = obstacles.empty() ? Vector3f::Zero() : obstacles.front();
    CAPTURE(example.transpose());
    CHECK(obstacles.empty());
  }
  for (std::size_t i = 0; i < ways.size(); ++i) {
    for (std::size_t k = 0; k < ways.size(); ++k) {
      if (i == k) continue;
      CAPTURE(i, k);
      const Overlap overlap = overlap_of(ways[i], ways[k], kSameStreet_m);
      CHECK(overlap.share > 0.1);
      CHECK(overlap.share < 0.9);
    }
  }
  // Same direction between the first two, some of both between the first and the third.
  CHECK(overlap_of(ways[0], ways[1], kSameStreet_m).same_direction > 0.7);
  CHECK(overlap_of(ways[0], ways[2], kSameStreet_m).same_direction > 0.2);
  CHECK(overlap_of(ways[0], ways[2], kSameStreet_m).same_direction < 0.8);
}

}  // namespace km
