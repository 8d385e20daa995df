#include "apps/lab/simulation/world/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kLeastHeight_m =
    1e-4F;  // smallest height of a triangle; at 300 m a float resolves 3e-5 m

bool has_area(const Vector3f& ab, const Vector3f& ac) {
  const float longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
  return ab.cross(ac).norm() > kLeastHeight_m * longest;
}

/// Two unit vectors that make a right-handed frame with the unit vector `axis` as third.
std::array<Vector3f, 2> across(const Vector3f& axis) {
  const Vector3f helper = std::abs(axis.z()) < 0.9F ? Vector3f::UnitZ() : Vector3f::UnitX();
  const Vector3f x = helper.cross(axis).normalized();
  return {x, axis.cross(x)};
}

Vector3f random_direction(SeededRandom& random) {
  const float z = random.uniform(-1.0F, 1.0F);
  const float angle = random.uniform(0.0F, kTwoPi);
  const float r = std::sqrt(std::max(0.0F, 1.0F - z * z));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Texture coordinates of a point on a plane with unit normal `n`: on walls v points up, on floors
/// they are (x, y).
Vector2f planar_uv(const Vector3f& p, const Vector3f& n) {
  const Vector2f horizontal(n.x(), n.y());
  if (horizontal.norm() < 0.05F) return {p.x(), p.y()};
  const Vector2f across = horizontal.normalized();
  const Vector3f u(-across.y(), across.x(), 0.0F);
  return {p.dot(u), p.dot(n.cross(u))};
}

}  // namespace

MaterialId Scene::paint(SurfaceClass label, Recipe recipe, const Vector3f& tint, float scale,
                        float specular, float glow) {
  const RecipeTraits& traits = traits_of(recipe);
  Material material{.label = label,
                    .tint = tint,
                    .base = texture(recipe),
                    .detail = texture(traits.detail),
                    .base_period_m = scale * traits.period_m,
                    .detail_period_m = scale * traits.detail_period_m,
                    .specular = specular,
                    .glow = glow};

  const auto known = std::ranges::find(materials_, material);
  const auto index = static_cast<MaterialId>(known - materials_.begin());
  if (known == materials_.end()) materials_.push_back(material);
  return index;
}

Scene::Object::Object(Scene& scene) : scene_(scene) {
  if (scene_.object_depth_++ > 0) return;
  const Vector3f x = scene_.T_world_local_.linear().col(0);
  const std::size_t first = scene_.mesh_.triangles.size();
  scene_.objects_.push_back({first, first, std::atan2(x.y(), x.x())});
}

Scene::Object::~Object() {
  if (--scene_.object_depth_ == 0)
    scene_.objects_.back().end_triangle = scene_.mesh_.triangles.size();
}

void Scene::move_to(World& world) {
  world.mesh = std::exchange(mesh_, {});
  world.objects = std::exchange(objects_, {});
  world.materials = std::exchange(materials_, {});
  world.textures = std::exchange(textures_, {});
  made_.clear();
}

std::uint16_t Scene::texture(Recipe recipe) {
  const auto known = std::find(made_.begin(), made_.end(), recipe);
  const auto index = static_cast<std::uint16_t>(known - made_.begin());
  if (known == made_.end()) {
    textures_.push_back(make_texture(recipe, seed_));
    made_.push_back(recipe);
  }
  return index;
}

std::uint32_t Scene::vertex(const Vector3f& p, const Vector3f& n, const Vector2f& uv) {
  mesh_.vertices.emplace_back(T_world_local_ * p);
  mesh_.normals.emplace_back((T_world_local_.linear() * n).normalized());
  mesh_.uv.emplace_back(uv + uv_offset_);
  return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void Scene::face(std::uint32_t a, std::uint32_t b, std::uint32_t c, MaterialId material) {
  const Vector3f ab = mesh_.vertices[b] - mesh_.vertices[a];
  const Vector3f ac = mesh_.vertices[c] - mesh_.vertices[a];
  if (!has_area(ab, ac)) return;
  mesh_.triangles.push_back({a, b, c});
  mesh_.materials.push_back(material);
}

void Scene::triangle(const Vector3f& a, const Vector3f& b, const Vector3f& c, MaterialId material) {
  if (!has_area(b - a, c - a)) return;
  const Vector3f unit = (b - a).cross(c - a).normalized();
  const auto i = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (const Vector3f& p : {a, b, c}) vertex(p, unit, planar_uv(p, unit));
  face(i, i + 1, i + 2, material);
}

void Scene::quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d,
                 MaterialId material) {
  if (!has_area(c - a, d - b)) return;
  const Vector3f unit = (c - a).cross(d - b).normalized();
  const auto i = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (const Vector3f& p : {a, b, c, d}) vertex(p, unit, planar_uv(p, unit));
  face(i, i + 1, i + 2, material);
  face(i, i + 2, i + 3, material);
}

void Scene::box(const Vector3f& low, const Vector3f& high, MaterialId material, unsigned sides) {
  const auto corner = [&](int x, int y, int z) {
    return Vector3f((x != 0 ? high : low).x(), (y != 0 ? high : low).y(),
                    (z != 0 ? high : low).z());
  };
  const auto side = [&](unsigned bit, const Vector3f& a, const Vector3f& b, const Vector3f& c,
                        const Vector3f& d) {
    if ((sides & bit) != 0) quad(a, b, c, d, material);
  };
  side(kSideLeft, corner(0, 1, 0), corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1));
  side(kSideRight, corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1), corner(1, 0, 1));
  side(kSideFront, corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1));
  side(kSideBack, corner(1, 1, 0), corner(0, 1, 0), corner(0, 1, 1), corner(1, 1, 1));
  side(kSideBottom, corner(0, 1, 0), corner(1, 1, 0), corner(1, 0, 0), corner(0, 0, 0));
  side(kSideTop, corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1));
}

void Scene::extrude(std::span<const Vector2f> outline, float z_low, float z_high,
                    MaterialId material) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2f& a = outline[i];
    const Vector2f& b = outline[(i + 1) % outline.size()];
    quad({a.x(), a.y(), z_low}, {b.x(), b.y(), z_low}, {b.x(), b.y(), z_high},
         {a.x(), a.y(), z_high}, material);
  }
  const auto at = [&](std::size_t i, float z) {
    return Vector3f(outline[i].x(), outline[i].y(), z);
  };
  const auto cap = [&](std::size_t a, std::size_t b, std::size_t c, float z) {
    triangle(at(a, z), at(b, z), at(c, z), material);
  };
  const std::size_t last = outline.size() - 1;
  for (std::size_t k = 0; k + 3 < outline.size(); ++k) cap(last, k, k + 1, z_high);
  cap(last - 2, last - 1, last, z_high);
  for (std::size_t k = 0; k + 3 < outline.size(); ++k) cap(last, k + 1, k, z_low);
  cap(last - 2, last, last - 1, z_low);
}

void Scene::grid(int rows, int columns, const std::function<GridPoint(int, int)>& point,
                 const CellMaterial& material) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  const auto columns1 = static_cast<std::size_t>(columns) + 1;
  std::vector<std::uint32_t> vertices(columns1 * (static_cast<std::size_t>(rows) + 1), kUnused);
  const auto index = [&](int row, int column) {
    std::uint32_t& i =
        vertices[static_cast<std::size_t>(row) * columns1 + static_cast<std::size_t>(column)];
    if (i == kUnused) {
      const GridPoint at = point(row, column);
      i = vertex(at.position, at.normal, at.uv);
    }
    return i;
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const std::optional<MaterialId> cell = material(row, column);
      if (!cell) continue;
      const std::uint32_t a = index(row, column);
      const std::uint32_t b = index(row, column + 1);
      const std::uint32_t c = index(row + 1, column + 1);
      const std::uint32_t d = index(row + 1, column);
      face(a, b, c, *cell);
      face(a, c, d, *cell);
    }
  }
}

void Scene::sheet(int rows, int columns, const std::function<Vector3f(int, int)>& point,
                  const CellMaterial& material, bool flat_uv) {
  const auto columns1 = static_cast<std::size_t>(columns) + 1;
  std::vector<Vector3f> points;
  points.reserve(columns1 * (static_cast<std::size_t>(rows) + 1));
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) points.push_back(point(row, column));
  const auto at = [&](int row, int column) -> const Vector3f& {
    return points[static_cast<std::size_t>(row) * columns1 + static_cast<std::size_t>(column)];
  };
  std::vector<float> along_column(1, 0.0F);
  std::vector<float> along_row(1, 0.0F);
  for (int row = 0; row < rows; ++row)
    along_column.push_back(along_column.back() + (at(row + 1, 0) - at(row, 0)).norm());
  for (int column = 0; column < columns; ++column)
    along_row.push_back(along_row.back() + (at(0, column + 1) - at(0, column)).norm());
  const auto grid_point = [&](int row, int column) {
    const Vector3f& p = at(row, column);
    // The sum over the cells around, by area; it holds at poles, where a row is one point.
    Vector3f n = Vector3f::Zero();
    for (const int r : {row - 1, row}) {
      for (const int c : {column - 1, column}) {
        if (r < 0 || c < 0 || r >= rows || c >= columns) continue;
        n += (at(r + 1, c + 1) - at(r, c)).cross(at(r + 1, c) - at(r, c + 1));
      }
    }
    const Vector2f uv = flat_uv ? Vector2f(p.x(), p.y())
                                : Vector2f(along_row[static_cast<std::size_t>(column)],
                                           along_column[static_cast<std::size_t>(row)]);
    return GridPoint{p, n, uv};
  };
  grid(rows, columns, grid_point, material);
}

Eigen::Isometry3f standing_at(const Vector3f& position, float yaw_rad) {
  Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
  T.linear() = Eigen::AngleAxisf(yaw_rad, Vector3f::UnitZ()).toRotationMatrix();
  T.translation() = position;
  return T;
}

void Scene::disc(const Vector3f& center, const Vector3f& x, const Vector3f& y, int segments,
                 MaterialId material) {
  const Vector3f n = x.cross(y).normalized();
  const std::uint32_t middle = vertex(center, n, planar_uv(center, n));
  for (int i = 0; i < segments; ++i) {
    const float angle = kTwoPi * static_cast<float>(i) / static_cast<float>(segments);
    const Vector3f p = center + std::cos(angle) * x + std::sin(angle) * y;
    vertex(p, n, planar_uv(p, n));
  }
  for (int i = 0; i < segments; ++i) {
    face(middle, middle + 1 + static_cast<std::uint32_t>(i),
         middle + 1 + static_cast<std::uint32_t>((i + 1) % segments), material);
  }
}

void Scene::cylinder(const Vector3f& from, const Vector3f& to, float radius_from, float radius_to,
                     int segments, MaterialId material, bool closed) {
  const float length = (to - from).norm();
  const Vector3f axis = (to - from) / length;
  const std::array<Vector3f, 2> sides = across(axis);
  const Vector3f& x = sides[0];
  const Vector3f& y = sides[1];
  const float slope = (radius_from - radius_to) / length;
  const float girth = kTwoPi * std::max(radius_from, radius_to);
  const auto point = [&](int row, int column) {
    const float share = static_cast<float>(column) / static_cast<float>(segments);
    const Vector3f out = std::cos(kTwoPi * share) * x + std::sin(kTwoPi * share) * y;
    const float radius = row == 0 ? radius_from : radius_to;
    const Vector3f base = row == 0 ? from : to;
    return GridPoint{
        base + radius * out, out + slope * axis, {share * girth, row == 0 ? 0.0F : length}};
  };
  grid(1, segments, point, [&](int, int) { return material; });
  if (!closed) return;
  if (radius_to > 0.0F) disc(to, radius_to * x, radius_to * y, segments, material);
  if (radius_from > 0.0F) disc(from, radius_from * y, radius_from * x, segments, material);
}

void Scene::ellipsoid(const Vector3f& center, const Vector3f& radii, int segments,
                      MaterialId material) {
  const int rows = std::max(2, segments / 2);
  const float girth = kTwoPi * std::max(radii.x(), radii.y());
  const float height = std::numbers::pi_v<float> * radii.z();
  const auto point = [&](float row, float column) {
    const float up = row / static_cast<float>(rows);
    const float round = column / static_cast<float>(segments);
    const float latitude = (up - 0.5F) * std::numbers::pi_v<float>;
    const Vector3f unit(std::cos(latitude) * std::cos(kTwoPi * round),
                        std::cos(latitude) * std::sin(kTwoPi * round), std::sin(latitude));
    return GridPoint{
        center + radii.cwiseProduct(unit), unit.cwiseQuotient(radii), {round * girth, up * height}};
  };
  grid(rows, segments, point, [&](int, int) { return material; });
}

void Scene::revolve(std::span<const Vector2f> profile, int segments, MaterialId material) {
  float girth = 0.0F;
  for (const Vector2f& p : profile) girth = std::max(girth, kTwoPi * p.x());
  float length = 0.0F;
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const Vector2f along = profile[i + 1] - profile[i];
    const Vector2f out = Vector2f(along.y(), -along.x()).normalized();
    const auto point = [&](int row, float column) {
      const float round = column / static_cast<float>(segments);
      const float c = std::cos(kTwoPi * round);
      const float s = std::sin(kTwoPi * round);
      const Vector2f& p = profile[i + static_cast<std::size_t>(row)];
      return GridPoint{{p.x() * c, p.x() * s, p.y()},
                       {out.x() * c, out.x() * s, out.y()},
                       {round * girth, row == 0 ? length : length + along.norm()}};
    };
    grid(1, segments, point, [&](int, int) { return material; });
    length += along.norm();
  }
}

void Scene::leaf_cluster(const Vector3f& center, const Vector3f& radii, int count, float leaf_m,
                         MaterialId material, SeededRandom& random) {
  for (int i = 0; i < count; ++i) {
    const Vector3f out = random_direction(random);
    const float depth = std::cbrt(random.uniform(0.15F, 1.0F));
    const Vector3f p = center + depth * radii.cwiseProduct(out);
    const Vector3f tilt = random_direction(random);
    const Vector3f n = (out + 0.8F * tilt + Vector3f(0.0F, 0.0F, 0.35F)).normalized();
    const auto [x, y] = across(n);
    const float turn = random.uniform(0.0F, kTwoPi);
    const float size = 0.5F * leaf_m * random.uniform(0.7F, 1.3F);
    const Vector3f length = size * (std::cos(turn) * x + std::sin(turn) * y);
    const Vector3f width = 0.6F * n.cross(length);
    const Vector2f uv(random.uniform(0.0F, 8.0F), random.uniform(0.0F, 8.0F));
    const Vector3f shade = (n + 0.7F * out).normalized();  // between the leaf's and the crown's
    const std::uint32_t first = vertex(p - length, shade, uv);
    vertex(p + width, shade, uv + Vector2f(size, 0.6F * size));
    vertex(p + length, shade, uv + Vector2f(2.0F * size, 0.0F));
    vertex(p - width, shade, uv + Vector2f(size, -0.6F * size));
    // Counter-clockwise about n: -length, -width, +length, +width.
    face(first, first + 3, first + 2, material);
    face(first, first + 2, first + 1, material);
  }
}

}  // namespace km
