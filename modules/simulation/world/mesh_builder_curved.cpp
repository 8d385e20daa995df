#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "modules/simulation/world/mesh_builder.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kTwoPi = 2.0F * std::numbers::pi_v<float>;

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

}  // namespace

void MeshBuilder::disc(const Vector3f& center, const Vector3f& x, const Vector3f& y, int segments,
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

void MeshBuilder::cylinder(const Vector3f& from, const Vector3f& to, float radius_from,
                           float radius_to, int segments, MaterialId material, bool closed) {
  const float length = (to - from).norm();
  const Vector3f axis = (to - from) / length;
  const auto [x, y] = across(axis);
  const float slope = (radius_from - radius_to) / length;
  const float girth = kTwoPi * std::max(radius_from, radius_to);
  const auto point = [&, x = x, y = y](int row, int column) {
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

void MeshBuilder::ellipsoid(const Vector3f& center, const Vector3f& radii, int segments,
                            MaterialId material) {
  const int rows = std::max(2, segments / 2);
  const float girth = kTwoPi * std::max(radii.x(), radii.y());
  const float height = std::numbers::pi_v<float> * radii.z();
  grid(
      rows, segments,
      [&](int row, int column) {
        const float up = static_cast<float>(row) / static_cast<float>(rows);
        const float round = static_cast<float>(column) / static_cast<float>(segments);
        const float latitude = (up - 0.5F) * std::numbers::pi_v<float>;
        const Vector3f unit(std::cos(latitude) * std::cos(kTwoPi * round),
                            std::cos(latitude) * std::sin(kTwoPi * round), std::sin(latitude));
        return GridPoint{center + radii.cwiseProduct(unit),
                         unit.cwiseQuotient(radii),
                         {round * girth, up * height}};
      },
      [&](int, int) { return material; });
}

void MeshBuilder::revolve(std::span<const Vector2f> profile, int segments, MaterialId material) {
  float girth = 0.0F;
  for (const Vector2f& p : profile) girth = std::max(girth, kTwoPi * p.x());
  float length = 0.0F;
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const Vector2f along = profile[i + 1] - profile[i];
    const Vector2f out = Vector2f(along.y(), -along.x()).normalized();
    grid(
        1, segments,
        [&](int row, int column) {
          const float round = static_cast<float>(column) / static_cast<float>(segments);
          const float c = std::cos(kTwoPi * round);
          const float s = std::sin(kTwoPi * round);
          const Vector2f& p = profile[i + static_cast<std::size_t>(row)];
          return GridPoint{{p.x() * c, p.x() * s, p.y()},
                           {out.x() * c, out.x() * s, out.y()},
                           {round * girth, row == 0 ? length : length + along.norm()}};
        },
        [&](int, int) { return material; });
    length += along.norm();
  }
}

void MeshBuilder::leaf_cluster(const Vector3f& center, const Vector3f& radii, int count,
                               float leaf_m, MaterialId material, SeededRandom& random) {
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
