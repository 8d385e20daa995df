#include "modules/simulation/world/vehicle_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kSectionPoints = 13;

/// The section from the right sill over the roof to the left one.
std::array<Vector3f, kSectionPoints> section(const BodyStation& s) {
  const float w = s.half_width;
  const float r = s.half_roof;
  const float height = s.belt - s.bottom;
  const std::array<Vector2f, 7> half = {{{0.93F * w, s.bottom},
                                         {0.985F * w, s.bottom + 0.25F * height},
                                         {w, s.bottom + 0.6F * height},
                                         {0.955F * w, s.belt},
                                         {r, s.top - 0.06F},
                                         {0.86F * r, s.top - 0.005F},
                                         {0.0F, s.top + 0.02F}}};
  std::array<Vector3f, kSectionPoints> points;
  for (int i = 0; i < kSectionPoints; ++i) {
    const bool right = i <= 6;
    const Vector2f& p = half[static_cast<std::size_t>(right ? i : 12 - i)];
    points[static_cast<std::size_t>(i)] = {s.x, right ? -p.x() : p.x(), p.y()};
  }
  return points;
}

void add_end(Scene& scene, const BodyStation& station, bool nose, MaterialId material) {
  const auto points = section(station);
  const Vector3f middle(station.x, 0.0F, 0.5F * (station.bottom + station.top));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3f& a = points[i];
    const Vector3f& b = points[(i + 1) % points.size()];
    if (nose) {
      scene.mesh.triangle(middle, b, a, material);
    } else {
      scene.mesh.triangle(middle, a, b, material);
    }
  }
}

/// A frame whose x is the vehicle's x, y its z, and z across to the right.
Eigen::Isometry3f side_view() {
  Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
  T.linear() = Eigen::AngleAxisf(0.5F * kPi, Vector3f::UnitX()).toRotationMatrix();
  return T;
}

}  // namespace

VehiclePaints vehicle_paints(Scene& scene, MaterialId body) {
  constexpr SurfaceClass kLabel = SurfaceClass::kVehicle;
  return {body,
          scene.plain(kLabel, 0.025F, 0.028F, 0.03F, 0.4F),
          scene.plain(kLabel, 0.025F, 0.025F, 0.027F),
          scene.plain(kLabel, 0.45F, 0.46F, 0.47F, 0.25F),
          scene.plain(kLabel, 0.8F, 0.8F, 0.78F, 0.1F),
          scene.plain(kLabel, 0.45F, 0.02F, 0.02F, 0.1F)};
}

void add_body(Scene& scene, std::span<const BodyStation> stations, const VehiclePaints& paints) {
  std::vector<std::array<Vector3f, kSectionPoints>> sections;
  for (const BodyStation& s : stations) sections.push_back(section(s));
  const auto point = [&](int row, int column) {
    return sections[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  };
  const auto is_glass = [&](int row, int column) {
    const BodyStation& s = stations[static_cast<std::size_t>(row)];
    return column == 3 || column == 8 ? s.side_glass : column >= 4 && column <= 7 && s.top_glass;
  };
  const int rows = static_cast<int>(stations.size()) - 1;
  const int columns = kSectionPoints - 1;
  scene.mesh.sheet(rows, columns, point, [&](int row, int column) {
    return is_glass(row, column) ? paints.glass : paints.body;
  });
  add_end(scene, stations.front(), true, paints.body);
  add_end(scene, stations.back(), false, paints.body);
  for (int row = 0; row < rows; ++row) {
    scene.mesh.quad(point(row, 0), point(row + 1, 0), point(row + 1, columns), point(row, columns),
                    paints.dark);
  }
}

void add_seam(Scene& scene, std::span<const BodyStation> stations, float x,
              const VehiclePaints& paints) {
  const auto behind = std::ranges::find_if(stations, [&](const BodyStation& s) { return s.x < x; });
  const BodyStation& a = *(behind - 1);
  const BodyStation& b = *behind;
  const float share = (x - a.x) / (b.x - a.x);
  BodyStation here = a;
  here.x = x;
  here.bottom = std::lerp(a.bottom, b.bottom, share);
  here.belt = std::lerp(a.belt, b.belt, share);
  here.half_width = std::lerp(a.half_width, b.half_width, share);
  const auto points = section(here);
  constexpr float kHalf = 0.007F;
  constexpr float kOut = 0.004F;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3f& low = points[i];
    const Vector3f& high = points[i + 1];
    for (const float side : {-1.0F, 1.0F}) {  // section() begins at the right, y < 0
      const auto corner = [&](const Vector3f& p, float dx) {
        return Vector3f(x + side * dx, -side * p.y() + side * kOut, p.z());
      };
      scene.mesh.quad(corner(low, kHalf), corner(low, -kHalf), corner(high, -kHalf),
                      corner(high, kHalf), paints.dark);
    }
  }
}

void add_wheel(Scene& scene, float x, float y, float radius, float width,
               const VehiclePaints& paints) {
  MeshBuilder& mesh = scene.mesh;
  const float out = y > 0.0F ? 1.0F : -1.0F;
  const float z = radius - 0.01F;  // pressed flat by its load
  mesh.cylinder({x, y - out * width, z}, {x, y, z}, radius, radius, 16, paints.dark);
  mesh.cylinder({x, y, z}, {x, y + out * 0.012F, z}, 0.66F * radius, 0.62F * radius, 12,
                paints.metal);
  for (int spoke = 0; spoke < 5; ++spoke) {  // dark gaps between the spokes
    const float angle = 0.4F * kPi * static_cast<float>(spoke);
    const Vector3f along(std::cos(angle), 0.0F, std::sin(angle));
    const Vector3f across(-out * along.z(), 0.0F, out * along.x());
    const Vector3f hub(x, y + out * 0.018F, z);
    mesh.quad(hub + 0.2F * radius * along, hub + radius * (0.42F * along - 0.14F * across),
              hub + 0.56F * radius * along, hub + radius * (0.42F * along + 0.14F * across),
              paints.dark);
  }
}

void add_wheel_arch(Scene& scene, float x, float y, float wheel_radius, float radius, float bottom,
                    const VehiclePaints& paints) {
  const float dip = std::asin(std::clamp((bottom - wheel_radius) / radius, -1.0F, 1.0F));
  std::vector<Vector2f> outline;
  constexpr int kPieces = 12;
  for (int i = 0; i <= kPieces; ++i) {
    const float angle = dip + (kPi - 2.0F * dip) * static_cast<float>(i) / kPieces;
    outline.emplace_back(x + radius * std::cos(angle), wheel_radius + radius * std::sin(angle));
  }
  const ScopedFrame frame(scene.mesh, side_view());
  const float near = y > 0.0F ? -y : -y - 0.1F;
  scene.mesh.extrude(outline, near, near + 0.1F, paints.dark);
}

void add_number_plate(Scene& scene, float x, float z, float forward, const VehiclePaints& paints,
                      SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  const float back = x - forward * 0.02F;
  mesh.box({std::min(x, back), -0.26F, z}, {std::max(x, back), 0.26F, z + 0.11F}, paints.white);
  const float ink = x + forward * 0.004F;
  for (int letter = 0; letter < 7; ++letter) {
    const float y = -0.21F + 0.062F * static_cast<float>(letter);
    const float end = y + (random.chance(0.3) ? 0.015F : 0.04F);
    const float left = forward > 0.0F ? y : end;  // seen from outside
    const float right = forward > 0.0F ? end : y;
    mesh.quad({ink, left, z + 0.02F}, {ink, right, z + 0.02F}, {ink, right, z + 0.09F},
              {ink, left, z + 0.09F}, paints.dark);
  }
}

}  // namespace km
