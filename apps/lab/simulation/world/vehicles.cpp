#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

/// A cross-section of a car's body. From one to the next, nose to tail, the skin is stretched.
struct BodyStation {
  float x = 0.0F;           // forward of the middle [m]
  float bottom = 0.25F;     // height of the sill [m]
  float belt = 0.9F;        // height of the windows' lower edge [m]
  float top = 1.4F;         // height of the roof or bonnet [m]
  float half_width = 0.9F;  // half width at the widest place [m]
  float half_roof = 0.6F;   // half width of the roof or bonnet [m]
  bool side_glass = false;  // windows from belt to roof, up to the next station
  bool top_glass = false;   // screen across the vehicle, up to the next station
};

struct VehiclePaints {
  MaterialId body = 0;
  MaterialId glass = 0;
  MaterialId dark = 0;  // rubber, bumpers, arches
  MaterialId metal = 0;
  MaterialId white = 0;
  MaterialId red = 0;
};

constexpr SurfaceClass kVehicleLabel = SurfaceClass::kVehicle;
constexpr int kSectionPoints = 13;

/// The section from the right sill over the roof to the left one.
std::array<Vector3f, kSectionPoints> section(const BodyStation& s) {
  const float w = s.half_width;
  const float r = s.half_roof;
  const float height = s.belt - s.bottom;
  const Vector2f half[] = {{0.93F * w, s.bottom},
                           {0.985F * w, s.bottom + 0.25F * height},
                           {w, s.bottom + 0.6F * height},
                           {0.955F * w, s.belt},
                           {r, s.top - 0.06F},
                           {0.86F * r, s.top - 0.005F},
                           {0.0F, s.top + 0.02F}};
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
    if (nose)
      scene.triangle(middle, b, a, material);
    else
      scene.triangle(middle, a, b, material);
  }
}

/// A frame whose x is the vehicle's x, y its z, and z across to the right.
Eigen::Isometry3f side_view() {
  Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
  T.linear() = Eigen::AngleAxisf(0.5F * kPi, Vector3f::UnitX()).toRotationMatrix();
  return T;
}

VehiclePaints vehicle_paints(Scene& scene, MaterialId body) {
  return {body,
          scene.plain(kVehicleLabel, {0.025F, 0.028F, 0.03F}, 0.4F),
          scene.plain(kVehicleLabel, {0.025F, 0.025F, 0.027F}),
          scene.plain(kVehicleLabel, {0.45F, 0.46F, 0.47F}, 0.25F),
          scene.plain(kVehicleLabel, {0.8F, 0.8F, 0.78F}, 0.1F),
          scene.plain(kVehicleLabel, {0.45F, 0.02F, 0.02F}, 0.1F)};
}

/// The skin over the stations, closed at both ends and below.
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
  const auto cell = [&](int row, int column) {
    return is_glass(row, column) ? paints.glass : paints.body;
  };
  scene.sheet(rows, columns, point, cell);
  add_end(scene, stations.front(), true, paints.body);
  add_end(scene, stations.back(), false, paints.body);
  for (int row = 0; row < rows; ++row) {
    scene.quad(point(row, 0), point(row + 1, 0), point(row + 1, columns), point(row, columns),
               paints.dark);
  }
}

/// The gap of a door: a dark line down the flanks from the windows to the sill, `x` within the
/// stations.
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
      scene.quad(corner(low, kHalf), corner(low, -kHalf), corner(high, -kHalf), corner(high, kHalf),
                 paints.dark);
    }
  }
}

/// A wheel that touches the ground at x, its outer face at y (the sign of y is the side).
void add_wheel(Scene& scene, float x, float y, float radius, float width,
               const VehiclePaints& paints) {
  const float out = y > 0.0F ? 1.0F : -1.0F;
  const float z = radius - 0.01F;  // pressed flat by its load
  scene.cylinder({x, y - out * width, z}, {x, y, z}, radius, radius, 16, paints.dark);
  scene.cylinder({x, y, z}, {x, y + out * 0.012F, z}, 0.66F * radius, 0.62F * radius, 12,
                 paints.metal);
  for (float spoke = 0; spoke < 5; ++spoke) {  // dark gaps between the spokes
    const float angle = 0.4F * kPi * spoke;
    const Vector3f along(std::cos(angle), 0.0F, std::sin(angle));
    const Vector3f across(-out * along.z(), 0.0F, out * along.x());
    const Vector3f hub(x, y + out * 0.018F, z);
    scene.quad(hub + 0.2F * radius * along, hub + radius * (0.42F * along - 0.14F * across),
               hub + 0.56F * radius * along, hub + radius * (0.42F * along + 0.14F * across),
               paints.dark);
  }
}

/// The dark arch above a wheel, in the plane y, cut off below height `bottom`.
void add_wheel_arch(Scene& scene, float x, float y, float wheel_radius, float radius, float bottom,
                    const VehiclePaints& paints) {
  const float dip = std::asin(std::clamp((bottom - wheel_radius) / radius, -1.0F, 1.0F));
  std::vector<Vector2f> outline;
  constexpr int kPieces = 12;
  for (float i = 0; i <= kPieces; ++i) {
    const float angle = dip + (kPi - 2.0F * dip) * i / kPieces;
    outline.emplace_back(x + radius * std::cos(angle), wheel_radius + radius * std::sin(angle));
  }
  const auto frame = scene.at(side_view());
  const float near = y > 0.0F ? -y : -y - 0.1F;
  scene.extrude(outline, near, near + 0.1F, paints.dark);
}

/// A number plate in the plane x, facing along `forward` (+1 or -1).
void add_number_plate(Scene& scene, float x, float z, float forward, const VehiclePaints& paints,
                      SeededRandom& random) {
  const float back = x - forward * 0.02F;
  scene.box({std::min(x, back), -0.26F, z}, {std::max(x, back), 0.26F, z + 0.11F}, paints.white);
  const float ink = x + forward * 0.004F;
  for (float letter = 0; letter < 7; ++letter) {
    const float y = -0.21F + 0.062F * letter;
    const float end = y + (random.chance(0.3) ? 0.015F : 0.04F);
    const float left = forward > 0.0F ? y : end;  // seen from outside
    const float right = forward > 0.0F ? end : y;
    scene.quad({ink, left, z + 0.02F}, {ink, right, z + 0.02F}, {ink, right, z + 0.09F},
               {ink, left, z + 0.09F}, paints.dark);
  }
}

/// Columns: x, bottom, belt, top, half width, half roof, side glass, screen.
constexpr BodyStation kSedan[] = {
    {2.20F, 0.28F, 0.58F, 0.62F, 0.70F, 0.56F},
    {2.08F, 0.24F, 0.66F, 0.72F, 0.82F, 0.68F},
    {1.75F, 0.22F, 0.76F, 0.82F, 0.87F, 0.74F},
    {0.98F, 0.21F, 0.89F, 0.95F, 0.88F, 0.74F, false, true},
    {0.32F, 0.21F, 0.92F, 1.38F, 0.88F, 0.60F, true},
    {-0.40F, 0.21F, 0.93F, 1.44F, 0.88F, 0.61F},
    {-0.50F, 0.21F, 0.93F, 1.44F, 0.88F, 0.61F, true},
    {-1.05F, 0.21F, 0.94F, 1.38F, 0.88F, 0.60F},
    {-1.18F, 0.22F, 0.95F, 1.34F, 0.88F, 0.60F, false, true},
    {-1.68F, 0.24F, 0.97F, 1.03F, 0.87F, 0.68F},
    {-2.05F, 0.27F, 0.94F, 1.01F, 0.84F, 0.68F},
    {-2.17F, 0.30F, 0.84F, 0.93F, 0.80F, 0.62F},
    {-2.22F, 0.34F, 0.66F, 0.72F, 0.76F, 0.58F},
};
constexpr BodyStation kHatchback[] = {
    {1.92F, 0.28F, 0.62F, 0.66F, 0.68F, 0.54F},
    {1.80F, 0.24F, 0.72F, 0.78F, 0.80F, 0.66F},
    {1.50F, 0.22F, 0.82F, 0.88F, 0.85F, 0.72F},
    {1.02F, 0.21F, 0.92F, 0.98F, 0.86F, 0.73F, false, true},
    {0.38F, 0.21F, 0.95F, 1.44F, 0.86F, 0.60F, true},
    {-0.36F, 0.21F, 0.96F, 1.50F, 0.86F, 0.61F},
    {-0.46F, 0.21F, 0.96F, 1.50F, 0.86F, 0.61F, true},
    {-1.12F, 0.21F, 0.98F, 1.47F, 0.86F, 0.60F},
    {-1.48F, 0.22F, 1.00F, 1.42F, 0.85F, 0.58F, false, true},
    {-1.84F, 0.26F, 0.98F, 1.06F, 0.83F, 0.66F},
    {-1.92F, 0.32F, 0.80F, 0.88F, 0.78F, 0.62F},
};
constexpr BodyStation kEstate[] = {
    {2.28F, 0.30F, 0.68F, 0.72F, 0.74F, 0.60F},
    {2.14F, 0.27F, 0.80F, 0.86F, 0.86F, 0.70F},
    {1.80F, 0.25F, 0.90F, 0.97F, 0.91F, 0.76F},
    {1.02F, 0.25F, 1.00F, 1.07F, 0.92F, 0.77F, false, true},
    {0.42F, 0.25F, 1.03F, 1.58F, 0.92F, 0.66F, true},
    {-0.35F, 0.25F, 1.04F, 1.64F, 0.92F, 0.67F},
    {-0.45F, 0.25F, 1.04F, 1.64F, 0.92F, 0.67F, true},
    {-1.15F, 0.25F, 1.05F, 1.63F, 0.92F, 0.66F},
    {-1.25F, 0.25F, 1.05F, 1.62F, 0.92F, 0.66F, true},
    {-1.90F, 0.26F, 1.07F, 1.58F, 0.91F, 0.65F, false, true},
    {-2.22F, 0.30F, 1.05F, 1.14F, 0.88F, 0.72F},
    {-2.30F, 0.36F, 0.86F, 0.94F, 0.84F, 0.68F},
};
constexpr BodyStation kVan[] = {
    {2.60F, 0.32F, 0.80F, 0.86F, 0.80F, 0.66F},
    {2.48F, 0.28F, 0.94F, 1.02F, 0.92F, 0.76F},
    {2.05F, 0.26F, 1.12F, 1.22F, 0.96F, 0.82F, false, true},
    {1.35F, 0.26F, 1.16F, 1.98F, 0.97F, 0.78F, true},
    {0.55F, 0.26F, 1.17F, 2.14F, 0.97F, 0.82F},
    {0.42F, 0.26F, 1.17F, 2.16F, 0.97F, 0.84F},
    {-2.40F, 0.27F, 1.17F, 2.16F, 0.97F, 0.84F},
    {-2.58F, 0.30F, 1.16F, 2.10F, 0.95F, 0.82F},
    {-2.62F, 0.34F, 1.14F, 2.02F, 0.93F, 0.80F},
};

struct CarModel {
  std::span<const BodyStation> stations;
  float axle_front;
  float axle_rear;
  float wheel_radius;
  float half_width;
  float light_z;
  float belt;
  float mirror_x;
};

// By VehicleKind.
constexpr CarModel kModels[] = {{kSedan, 1.38F, -1.32F, 0.32F, 0.88F, 0.64F, 0.93F, 0.75F},
                                {kHatchback, 1.22F, -1.2F, 0.3F, 0.86F, 0.7F, 0.96F, 0.8F},
                                {kEstate, 1.42F, -1.38F, 0.36F, 0.92F, 0.76F, 1.04F, 0.82F},
                                {kVan, 1.72F, -1.55F, 0.34F, 0.97F, 0.86F, 1.16F, 1.75F}};

void add_running_gear(Scene& scene, const CarModel& model, const VehiclePaints& paints) {
  for (const float x : {model.axle_front, model.axle_rear}) {
    for (const float side : {-1.0F, 1.0F}) {
      const float y = side * model.half_width;
      add_wheel_arch(scene, x, y + side * 0.004F, model.wheel_radius, 1.17F * model.wheel_radius,
                     0.24F, paints);
      add_wheel(scene, x, y + side * 0.02F, model.wheel_radius, 0.2F, paints);
    }
  }
}

void add_ends(Scene& scene, const CarModel& model, const VehiclePaints& paints,
              SeededRandom& random) {
  const float nose = model.stations.front().x;
  const float tail = model.stations.back().x;
  const float w = model.half_width;
  for (const float side : {-1.0F, 1.0F}) {
    scene.ellipsoid({nose - 0.14F, side * 0.72F * w, model.light_z}, {0.17F, 0.17F, 0.085F}, 8,
                    paints.white);
    scene.ellipsoid({tail + 0.1F, side * 0.8F * w, model.light_z + 0.12F}, {0.13F, 0.12F, 0.1F}, 8,
                    paints.red);
    scene.ellipsoid({model.mirror_x, side * (w + 0.09F), model.belt + 0.09F},
                    {0.09F, 0.11F, 0.075F}, 8, paints.body);
  }
  scene.box({nose - 0.12F, -0.78F * w, 0.26F}, {nose + 0.03F, 0.78F * w, 0.4F}, paints.dark);
  scene.box({nose - 0.1F, -0.34F * w, model.light_z - 0.12F},
            {nose + 0.015F, 0.34F * w, model.light_z + 0.02F}, paints.dark);  // grille
  scene.box({tail - 0.03F, -0.82F * w, 0.3F}, {tail + 0.12F, 0.82F * w, 0.46F}, paints.dark);
  add_number_plate(scene, nose + 0.04F, 0.42F, 1.0F, paints, random);
  add_number_plate(scene, tail - 0.04F, model.light_z - 0.05F, -1.0F, paints, random);
}

/// Gaps and handles of the doors, where the skin is widest.
void add_doors(Scene& scene, const CarModel& model, const VehiclePaints& paints) {
  for (const float x : {model.axle_front - 0.5F, -0.45F, model.axle_rear + 0.42F})
    add_seam(scene, model.stations, x, paints);
  for (const float side : {-1.0F, 1.0F}) {
    const auto strip = [&](float x0, float x1, float z0, float z1, float out, MaterialId material) {
      const float y0 = side * (model.half_width - 0.06F);
      const float y1 = side * (model.half_width + out);
      scene.box({x0, std::min(y0, y1), z0}, {x1, std::max(y0, y1), z1}, material);
    };
    strip(-0.36F, -0.2F, model.belt - 0.14F, model.belt - 0.11F, 0.02F, paints.metal);
    strip(model.axle_rear + 0.4F, model.axle_front - 0.45F, 0.27F, 0.33F, 0.004F, paints.dark);
  }
}

/// Two doors with windows in the tail of a van.
void add_rear_doors(Scene& scene, const CarModel& model, const VehiclePaints& paints) {
  const float tail = model.stations.back().x;
  scene.box({tail - 0.012F, -0.012F, 0.5F}, {tail + 0.1F, 0.012F, 1.95F}, paints.dark);
  scene.box({tail - 0.05F, 0.06F, 1.0F}, {tail + 0.1F, 0.14F, 1.06F}, paints.dark);
  for (const float y : {-0.68F, 0.1F})
    scene.box({tail - 0.014F, y, 1.24F}, {tail + 0.1F, y + 0.58F, 1.8F}, paints.glass);
}

MaterialId car_paint(Scene& scene, SeededRandom& random) {
  const Vector3f paints[] = {{0.72F, 0.72F, 0.7F},  {0.04F, 0.04F, 0.045F}, {0.32F, 0.33F, 0.34F},
                             {0.14F, 0.15F, 0.17F}, {0.42F, 0.04F, 0.03F},  {0.03F, 0.08F, 0.28F},
                             {0.05F, 0.16F, 0.1F},  {0.5F, 0.44F, 0.33F},   {0.12F, 0.28F, 0.42F},
                             {0.6F, 0.6F, 0.61F},   {0.55F, 0.3F, 0.04F}};
  return scene.plain(kVehicleLabel, random.pick(paints), 0.14F);
}

VehiclePaints army_paints(Scene& scene, SeededRandom& random) {
  const float shade = 1.0F + 0.15F * static_cast<float>(random.below(3));
  return vehicle_paints(scene, scene.paint(kVehicleLabel, kPaintedMetal,
                                           {0.17F * shade, 0.18F * shade, 0.1F * shade}));
}

/// Hoops under canvas over a load bed from x0 to x1.
void add_canvas_cover(Scene& scene, float x0, float x1, float half, float bed, float eave,
                      float top, SeededRandom& random) {
  const float shade = 0.9F + 0.1F * static_cast<float>(random.below(3));
  const auto canvas =
      scene.paint(kVehicleLabel, kCanvas, {0.24F * shade, 0.24F * shade, 0.14F * shade});
  const Eigen::Vector2f arch[] = {
      {-half, bed}, {-half, eave}, {-0.7F * half, top - 0.06F}, {0.7F * half, top - 0.06F},
      {half, eave}, {half, bed}};
  constexpr int kHoops = 8;
  const auto point = [&](int row, int column) {
    const float x = x1 + (x0 - x1) * static_cast<float>(row) / kHoops;
    const float sag = row % 2 == 0 ? 1.0F : 0.97F;  // cloth hangs in between hoops
    const Eigen::Vector2f& p = arch[static_cast<std::size_t>(column)];
    return Vector3f(x, sag * p.x(), p.y() > bed ? bed + sag * (p.y() - bed) : bed);
  };
  scene.sheet(kHoops, 5, point, canvas);
  const auto inside = scene.plain(kVehicleLabel, {0.02F, 0.02F, 0.018F});
  for (int i = 0; i + 1 < 6; ++i) {
    const Vector3f front(x1, 0.0F, bed);
    const Vector3f back(x0, 0.0F, bed);
    scene.triangle(front, point(0, i + 1), point(0, i), canvas);
    scene.triangle(back, point(kHoops, i), point(kHoops, i + 1), inside);
  }
}

}  // namespace

void add_vehicle(Scene& scene, VehicleKind kind, SeededRandom& random) {
  const Scene::Object object(scene);
  const CarModel& model = kModels[static_cast<std::size_t>(kind)];
  const VehiclePaints paints = vehicle_paints(scene, car_paint(scene, random));
  add_body(scene, model.stations, paints);
  add_running_gear(scene, model, paints);
  add_ends(scene, model, paints, random);
  add_doors(scene, model, paints);
  if (kind == VehicleKind::kVan) add_rear_doors(scene, model, paints);
}

void add_army_truck(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const VehiclePaints paints = army_paints(scene, random);
  static constexpr BodyStation kCab[] = {
      {3.28F, 0.75F, 1.20F, 1.26F, 0.70F, 0.62F},
      {3.18F, 0.70F, 1.34F, 1.42F, 0.78F, 0.68F},
      {2.05F, 0.70F, 1.46F, 1.54F, 0.80F, 0.70F},
      {1.98F, 0.70F, 1.50F, 1.58F, 1.05F, 0.92F, false, true},
      {1.70F, 0.70F, 1.52F, 2.30F, 1.07F, 0.92F, true},
      {1.00F, 0.70F, 1.52F, 2.36F, 1.07F, 0.93F},
      {0.72F, 0.70F, 1.52F, 2.36F, 1.07F, 0.93F},
      {0.68F, 0.70F, 1.50F, 2.30F, 1.06F, 0.92F},
  };
  add_body(scene, kCab, paints);
  scene.box({-3.25F, -0.45F, 0.62F}, {3.1F, 0.45F, 0.82F}, paints.dark);  // chassis
  scene.box({-3.3F, -1.13F, 1.0F}, {0.55F, 1.13F, 1.14F}, paints.body);
  scene.box({-3.3F, -1.13F, 1.14F}, {0.55F, -1.07F, 1.7F}, paints.body);
  scene.box({-3.3F, 1.07F, 1.14F}, {0.55F, 1.13F, 1.7F}, paints.body);
  scene.box({-3.3F, -1.07F, 1.14F}, {-3.24F, 1.07F, 1.7F}, paints.body);
  for (float x = -3.1F; x < 0.5F; x += 0.7F)
    for (const float y : {-1.16F, 1.13F})
      scene.box({x, y, 1.02F}, {x + 0.07F, y + 0.03F, 1.68F}, paints.dark);
  add_canvas_cover(scene, -3.28F, 0.53F, 1.09F, 1.68F, 2.45F, 2.85F, random);
  for (const float x : {2.45F, -1.35F, -2.45F})
    for (const float y : {-1.08F, 1.08F}) add_wheel(scene, x, y, 0.52F, 0.3F, paints);
  for (const float side : {-1.0F, 1.0F}) {
    const float y = side * 0.86F;
    scene.box({2.0F, y - 0.22F, 1.06F}, {3.0F, y + 0.22F, 1.14F}, paints.body);  // mudguard
    scene.cylinder({3.1F, y, 1.2F}, {3.2F, y, 1.2F}, 0.12F, 0.12F, 12, paints.white);
    scene.box({0.9F, side * 1.25F - 0.06F, 1.6F}, {1.2F, side * 1.25F + 0.06F, 2.0F}, paints.dark);
    scene.cylinder({-0.2F, side * 0.9F, 0.75F}, {0.6F, side * 0.9F, 0.75F}, 0.24F, 0.24F, 14,
                   paints.body);  // tanks
  }
  scene.box({3.2F, -1.0F, 0.62F}, {3.36F, 1.0F, 0.84F}, paints.dark);
  add_number_plate(scene, 3.37F, 0.66F, 1.0F, paints, random);
  add_number_plate(scene, -3.32F, 0.7F, -1.0F, paints, random);
}

void add_army_jeep(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const VehiclePaints paints = army_paints(scene, random);
  static constexpr BodyStation kBody[] = {
      {1.95F, 0.48F, 0.92F, 0.98F, 0.60F, 0.52F},
      {1.88F, 0.46F, 0.98F, 1.04F, 0.66F, 0.56F},
      {0.72F, 0.45F, 1.06F, 1.13F, 0.72F, 0.62F},
      {0.66F, 0.45F, 1.06F, 1.14F, 0.80F, 0.72F, false, true},
      {0.52F, 0.45F, 1.07F, 1.76F, 0.80F, 0.72F},
      {0.46F, 0.45F, 1.07F, 1.76F, 0.80F, 0.72F},
      {0.44F, 0.45F, 1.07F, 1.70F, 0.80F, 0.72F},
  };
  add_body(scene, kBody, paints);
  scene.box({-1.95F, -0.8F, 0.45F}, {0.46F, 0.8F, 1.0F}, paints.body, kSidesNoBottom);
  add_canvas_cover(scene, -1.92F, 0.46F, 0.78F, 0.98F, 1.6F, 1.82F, random);
  for (const float x : {1.2F, -1.25F}) {
    for (const float side : {-1.0F, 1.0F}) {
      add_wheel_arch(scene, x, side * 0.81F, 0.38F, 0.46F, 0.45F, paints);
      add_wheel(scene, x, side * 0.88F, 0.38F, 0.24F, paints);
    }
  }
  for (const float y : {-0.42F, 0.42F})
    scene.cylinder({1.9F, y, 0.82F}, {1.98F, y, 0.82F}, 0.1F, 0.1F, 12, paints.white);
  for (float slot = 0; slot < 7; ++slot) {
    const float y = -0.24F + 0.08F * slot;
    scene.box({1.9F, y - 0.022F, 0.62F}, {1.965F, y + 0.022F, 0.86F}, paints.dark);
  }
  scene.box({1.95F, -0.75F, 0.44F}, {2.08F, 0.75F, 0.58F}, paints.dark);
  scene.cylinder({-1.95F, 0.1F, 0.98F}, {-2.15F, 0.1F, 0.98F}, 0.36F, 0.36F, 18, paints.dark);
  add_number_plate(scene, 2.09F, 0.46F, 1.0F, paints, random);
}

}  // namespace km
