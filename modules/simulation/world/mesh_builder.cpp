#include "modules/simulation/world/mesh_builder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kLeastHeight_m = 1e-4F;  // of a triangle; at 300 m a float resolves 3e-5 m

bool has_area(const Vector3f& ab, const Vector3f& ac) {
  const float longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
  return ab.cross(ac).norm() > kLeastHeight_m * longest;
}

float cross2(const Vector2f& a, const Vector2f& b) {
  return a.x() * b.y() - a.y() * b.x();
}

bool inside_triangle(const Vector2f& p, const Vector2f& a, const Vector2f& b, const Vector2f& c) {
  return cross2(b - a, p - a) > 0.0F && cross2(c - b, p - b) > 0.0F && cross2(a - c, p - c) > 0.0F;
}

/// Ears of a simple counter-clockwise polygon (Meisters, "Polygons have ears", 1975).
std::vector<std::array<std::size_t, 3>> triangulated(std::span<const Vector2f> outline) {
  std::vector<std::size_t> left(outline.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
  std::vector<std::array<std::size_t, 3>> triangles;
  while (left.size() > 3) {
    const std::size_t n = left.size();
    std::size_t ear = n;
    for (std::size_t i = 0; i < n && ear == n; ++i) {
      const Vector2f& a = outline[left[(i + n - 1) % n]];
      const Vector2f& b = outline[left[i]];
      const Vector2f& c = outline[left[(i + 1) % n]];
      if (cross2(b - a, c - b) < 0.0F) continue;
      const bool empty = std::ranges::none_of(
          left, [&](std::size_t k) { return inside_triangle(outline[k], a, b, c); });
      if (empty) ear = i;
    }
    if (ear == n) {
      throw std::invalid_argument("MeshBuilder: an outline of " + std::to_string(outline.size()) +
                                  " points is not simple and counter-clockwise");
    }
    triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace

Vector2f planar_uv(const Vector3f& p, const Vector3f& n) {
  const Vector2f horizontal(n.x(), n.y());
  if (horizontal.norm() < 0.05F) return {p.x(), p.y()};
  const Vector2f across = horizontal.normalized();
  const Vector3f u(-across.y(), across.x(), 0.0F);
  return {p.dot(u), p.dot(n.cross(u))};
}

std::uint32_t MeshBuilder::vertex(const Vector3f& p, const Vector3f& n, const Vector2f& uv) {
  mesh_.vertices.emplace_back(T_world_local_ * p);
  mesh_.normals.emplace_back((T_world_local_.linear() * n).normalized());
  mesh_.uv.emplace_back(uv + uv_offset_);
  return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void MeshBuilder::face(std::uint32_t a, std::uint32_t b, std::uint32_t c, MaterialId material) {
  const Vector3f ab = mesh_.vertices[b] - mesh_.vertices[a];
  const Vector3f ac = mesh_.vertices[c] - mesh_.vertices[a];
  if (!has_area(ab, ac)) return;
  mesh_.triangles.push_back({a, b, c});
  mesh_.materials.push_back(material);
}

void MeshBuilder::triangle(const Vector3f& a, const Vector3f& b, const Vector3f& c,
                           MaterialId material) {
  if (!has_area(b - a, c - a)) return;
  const Vector3f unit = (b - a).cross(c - a).normalized();
  const std::uint32_t i = vertex(a, unit, planar_uv(a, unit));
  vertex(b, unit, planar_uv(b, unit));
  vertex(c, unit, planar_uv(c, unit));
  face(i, i + 1, i + 2, material);
}

void MeshBuilder::quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d,
                       MaterialId material) {
  if (!has_area(c - a, d - b)) return;
  const Vector3f unit = (c - a).cross(d - b).normalized();
  const std::uint32_t i = vertex(a, unit, planar_uv(a, unit));
  vertex(b, unit, planar_uv(b, unit));
  vertex(c, unit, planar_uv(c, unit));
  vertex(d, unit, planar_uv(d, unit));
  face(i, i + 1, i + 2, material);
  face(i, i + 2, i + 3, material);
}

void MeshBuilder::box(const Eigen::AlignedBox3f& box, MaterialId material, unsigned sides) {
  const auto corner = [&](int x, int y, int z) {
    return Vector3f(x != 0 ? box.max().x() : box.min().x(), y != 0 ? box.max().y() : box.min().y(),
                    z != 0 ? box.max().z() : box.min().z());
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

void MeshBuilder::polygon(std::span<const Vector2f> outline, float z, MaterialId material,
                          bool up) {
  const auto at = [&](std::size_t i) { return Vector3f(outline[i].x(), outline[i].y(), z); };
  for (const auto& [a, b, c] : triangulated(outline)) {
    if (up) {
      triangle(at(a), at(b), at(c), material);
    } else {
      triangle(at(a), at(c), at(b), material);
    }
  }
}

void MeshBuilder::extrude(std::span<const Vector2f> outline, float z_low, float z_high,
                          MaterialId sides, MaterialId ends) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2f& a = outline[i];
    const Vector2f& b = outline[(i + 1) % outline.size()];
    quad({a.x(), a.y(), z_low}, {b.x(), b.y(), z_low}, {b.x(), b.y(), z_high},
         {a.x(), a.y(), z_high}, sides);
  }
  polygon(outline, z_high, ends, true);
  polygon(outline, z_low, ends, false);
}

void MeshBuilder::grid(int rows, int columns, const std::function<GridPoint(int, int)>& point,
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

void MeshBuilder::sheet(int rows, int columns, const std::function<Vector3f(int, int)>& point,
                        const CellMaterial& material, bool flat_uv) {
  const auto columns1 = static_cast<std::size_t>(columns) + 1;
  std::vector<Vector3f> points;
  points.reserve(columns1 * (static_cast<std::size_t>(rows) + 1));
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) points.push_back(point(row, column));
  }
  const auto at = [&](int row, int column) -> const Vector3f& {
    return points[static_cast<std::size_t>(row) * columns1 + static_cast<std::size_t>(column)];
  };
  std::vector<float> along_column(1, 0.0F);
  std::vector<float> along_row(1, 0.0F);
  for (int row = 0; row < rows; ++row) {
    along_column.push_back(along_column.back() + (at(row + 1, 0) - at(row, 0)).norm());
  }
  for (int column = 0; column < columns; ++column) {
    along_row.push_back(along_row.back() + (at(0, column + 1) - at(0, column)).norm());
  }
  grid(
      rows, columns,
      [&](int row, int column) {
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
      },
      material);
}

void MeshBuilder::sheet(int rows, int columns, const std::function<Vector3f(int, int)>& point,
                        MaterialId material, bool flat_uv) {
  sheet(
      rows, columns, point, [&](int, int) { return material; }, flat_uv);
}

Eigen::Isometry3f standing_at(const Vector3f& position, float yaw_rad) {
  Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
  T.linear() = Eigen::AngleAxisf(yaw_rad, Vector3f::UnitZ()).toRotationMatrix();
  T.translation() = position;
  return T;
}

}  // namespace km
