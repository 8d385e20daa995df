#include "modules/simulation/world/vehicles.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "modules/simulation/world/vehicle_parts.hpp"

namespace km {
namespace {

using Eigen::Vector3f;

constexpr SurfaceClass kLabel = SurfaceClass::kVehicle;

/// Columns: x, bottom, belt, top, half width, half roof, side glass, screen.
constexpr std::array<BodyStation, 13> kSedan = {{
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
}};
constexpr std::array<BodyStation, 11> kHatchback = {{
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
}};
constexpr std::array<BodyStation, 12> kEstate = {{
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
}};
constexpr std::array<BodyStation, 9> kVan = {{
    {2.60F, 0.32F, 0.80F, 0.86F, 0.80F, 0.66F},
    {2.48F, 0.28F, 0.94F, 1.02F, 0.92F, 0.76F},
    {2.05F, 0.26F, 1.12F, 1.22F, 0.96F, 0.82F, false, true},
    {1.35F, 0.26F, 1.16F, 1.98F, 0.97F, 0.78F, true},
    {0.55F, 0.26F, 1.17F, 2.14F, 0.97F, 0.82F},
    {0.42F, 0.26F, 1.17F, 2.16F, 0.97F, 0.84F},
    {-2.40F, 0.27F, 1.17F, 2.16F, 0.97F, 0.84F},
    {-2.58F, 0.30F, 1.16F, 2.10F, 0.95F, 0.82F},
    {-2.62F, 0.34F, 1.14F, 2.02F, 0.93F, 0.80F},
}};

struct CarModel {
  std::span<const BodyStation> stations;
  float axle_front = 1.35F;
  float axle_rear = -1.3F;
  float wheel_radius = 0.32F;
  float half_width = 0.88F;
  float light_z = 0.66F;
  float belt = 0.93F;
  float mirror_x = 0.75F;
};

CarModel model_of(VehicleKind kind) {
  switch (kind) {
    case VehicleKind::kHatchback:
      return {kHatchback, 1.22F, -1.2F, 0.3F, 0.86F, 0.7F, 0.96F, 0.8F};
    case VehicleKind::kEstate:
      return {kEstate, 1.42F, -1.38F, 0.36F, 0.92F, 0.76F, 1.04F, 0.82F};
    case VehicleKind::kVan:
      return {kVan, 1.72F, -1.55F, 0.34F, 0.97F, 0.86F, 1.16F, 1.75F};
    case VehicleKind::kSedan:
      break;
  }
  return {kSedan, 1.38F, -1.32F, 0.32F, 0.88F, 0.64F, 0.93F, 0.75F};
}

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
  MeshBuilder& mesh = scene.mesh;
  const float nose = model.stations.front().x;
  const float tail = model.stations.back().x;
  const float w = model.half_width;
  for (const float side : {-1.0F, 1.0F}) {
    mesh.ellipsoid({nose - 0.14F, side * 0.72F * w, model.light_z}, {0.17F, 0.17F, 0.085F}, 8,
                   paints.white);
    mesh.ellipsoid({tail + 0.1F, side * 0.8F * w, model.light_z + 0.12F}, {0.13F, 0.12F, 0.1F}, 8,
                   paints.red);
    mesh.ellipsoid({model.mirror_x, side * (w + 0.09F), model.belt + 0.09F}, {0.09F, 0.11F, 0.075F},
                   8, paints.body);
  }
  mesh.box({nose - 0.12F, -0.78F * w, 0.26F}, {nose + 0.03F, 0.78F * w, 0.4F}, paints.dark);
  mesh.box({nose - 0.1F, -0.34F * w, model.light_z - 0.12F},
           {nose + 0.015F, 0.34F * w, model.light_z + 0.02F}, paints.dark);  // grille
  mesh.box({tail - 0.03F, -0.82F * w, 0.3F}, {tail + 0.12F, 0.82F * w, 0.46F}, paints.dark);
  add_number_plate(scene, nose + 0.04F, 0.42F, 1.0F, paints, random);
  add_number_plate(scene, tail - 0.04F, model.light_z - 0.05F, -1.0F, paints, random);
}

/// Gaps and handles of the doors, where the skin is widest.
void add_doors(Scene& scene, const CarModel& model, const VehiclePaints& paints) {
  MeshBuilder& mesh = scene.mesh;
  for (const float x : {model.axle_front - 0.5F, -0.45F, model.axle_rear + 0.42F}) {
    add_seam(scene, model.stations, x, paints);
  }
  for (const float side : {-1.0F, 1.0F}) {
    const auto strip = [&](float x0, float x1, float z0, float z1, float out, MaterialId material) {
      const float y0 = side * (model.half_width - 0.06F);
      const float y1 = side * (model.half_width + out);
      mesh.box({x0, std::min(y0, y1), z0}, {x1, std::max(y0, y1), z1}, material);
    };
    strip(-0.36F, -0.2F, model.belt - 0.14F, model.belt - 0.11F, 0.02F, paints.metal);
    strip(model.axle_rear + 0.4F, model.axle_front - 0.45F, 0.27F, 0.33F, 0.004F, paints.dark);
  }
}

/// Two doors with windows in the tail of a van.
void add_rear_doors(Scene& scene, const CarModel& model, const VehiclePaints& paints) {
  MeshBuilder& mesh = scene.mesh;
  const float tail = model.stations.back().x;
  mesh.box({tail - 0.012F, -0.012F, 0.5F}, {tail + 0.1F, 0.012F, 1.95F}, paints.dark);
  mesh.box({tail - 0.05F, 0.06F, 1.0F}, {tail + 0.1F, 0.14F, 1.06F}, paints.dark);
  for (const float y : {-0.68F, 0.1F}) {
    mesh.box({tail - 0.014F, y, 1.24F}, {tail + 0.1F, y + 0.58F, 1.8F}, paints.glass);
  }
}

MaterialId car_paint(Scene& scene, SeededRandom& random) {
  static constexpr std::array<std::array<float, 3>, 11> kPaints = {{{0.72F, 0.72F, 0.7F},
                                                                    {0.04F, 0.04F, 0.045F},
                                                                    {0.32F, 0.33F, 0.34F},
                                                                    {0.14F, 0.15F, 0.17F},
                                                                    {0.42F, 0.04F, 0.03F},
                                                                    {0.03F, 0.08F, 0.28F},
                                                                    {0.05F, 0.16F, 0.1F},
                                                                    {0.5F, 0.44F, 0.33F},
                                                                    {0.12F, 0.28F, 0.42F},
                                                                    {0.6F, 0.6F, 0.61F},
                                                                    {0.55F, 0.3F, 0.04F}}};
  const auto& [red, green, blue] = kPaints[static_cast<std::size_t>(random.below(kPaints.size()))];
  return scene.plain(kLabel, red, green, blue, 0.14F);
}

VehiclePaints army_paints(Scene& scene, SeededRandom& random) {
  const float shade = 1.0F + 0.15F * static_cast<float>(random.below(3));
  return vehicle_paints(scene, scene.paint(kLabel, Recipe::kPaintedMetal,
                                           {0.17F * shade, 0.18F * shade, 0.1F * shade}));
}

/// Hoops under canvas over a load bed from x0 to x1.
void add_canvas_cover(Scene& scene, float x0, float x1, float half, float bed, float eave,
                      float top, SeededRandom& random) {
  const float shade = 0.9F + 0.1F * static_cast<float>(random.below(3));
  const MaterialId canvas =
      scene.paint(kLabel, Recipe::kCanvas, {0.24F * shade, 0.24F * shade, 0.14F * shade});
  const std::array<Eigen::Vector2f, 6> arch = {{{-half, bed},
                                                {-half, eave},
                                                {-0.7F * half, top - 0.06F},
                                                {0.7F * half, top - 0.06F},
                                                {half, eave},
                                                {half, bed}}};
  constexpr int kHoops = 8;
  const auto point = [&](int row, int column) {
    const float x = x1 + (x0 - x1) * static_cast<float>(row) / kHoops;
    const float sag = row % 2 == 0 ? 1.0F : 0.97F;  // cloth hangs in between hoops
    const Eigen::Vector2f& p = arch[static_cast<std::size_t>(column)];
    return Vector3f(x, sag * p.x(), p.y() > bed ? bed + sag * (p.y() - bed) : bed);
  };
  scene.mesh.sheet(kHoops, 5, point, canvas);
  const MaterialId inside = scene.plain(kLabel, 0.02F, 0.02F, 0.018F);
  for (int i = 0; i + 1 < 6; ++i) {
    const Vector3f front(x1, 0.0F, bed);
    const Vector3f back(x0, 0.0F, bed);
    scene.mesh.triangle(front, point(0, i + 1), point(0, i), canvas);
    scene.mesh.triangle(back, point(kHoops, i), point(kHoops, i + 1), inside);
  }
}

}  // namespace

void add_vehicle(Scene& scene, VehicleKind kind, SeededRandom& random) {
  const CarModel model = model_of(kind);
  const VehiclePaints paints = vehicle_paints(scene, car_paint(scene, random));
  add_body(scene, model.stations, paints);
  add_running_gear(scene, model, paints);
  add_ends(scene, model, paints, random);
  add_doors(scene, model, paints);
  if (kind == VehicleKind::kVan) add_rear_doors(scene, model, paints);
}

void add_army_truck(Scene& scene, SeededRandom& random) {
  const VehiclePaints paints = army_paints(scene, random);
  MeshBuilder& mesh = scene.mesh;
  static constexpr std::array<BodyStation, 8> kCab = {{
      {3.28F, 0.75F, 1.20F, 1.26F, 0.70F, 0.62F},
      {3.18F, 0.70F, 1.34F, 1.42F, 0.78F, 0.68F},
      {2.05F, 0.70F, 1.46F, 1.54F, 0.80F, 0.70F},
      {1.98F, 0.70F, 1.50F, 1.58F, 1.05F, 0.92F, false, true},
      {1.70F, 0.70F, 1.52F, 2.30F, 1.07F, 0.92F, true},
      {1.00F, 0.70F, 1.52F, 2.36F, 1.07F, 0.93F},
      {0.72F, 0.70F, 1.52F, 2.36F, 1.07F, 0.93F},
      {0.68F, 0.70F, 1.50F, 2.30F, 1.06F, 0.92F},
  }};
  add_body(scene, kCab, paints);
  mesh.box({-3.25F, -0.45F, 0.62F}, {3.1F, 0.45F, 0.82F}, paints.dark);  // chassis
  mesh.box({-3.3F, -1.13F, 1.0F}, {0.55F, 1.13F, 1.14F}, paints.body);
  mesh.box({-3.3F, -1.13F, 1.14F}, {0.55F, -1.07F, 1.7F}, paints.body);
  mesh.box({-3.3F, 1.07F, 1.14F}, {0.55F, 1.13F, 1.7F}, paints.body);
  mesh.box({-3.3F, -1.07F, 1.14F}, {-3.24F, 1.07F, 1.7F}, paints.body);
  for (float x = -3.1F; x < 0.5F; x += 0.7F) {
    for (const float y : {-1.16F, 1.13F}) {
      mesh.box({x, y, 1.02F}, {x + 0.07F, y + 0.03F, 1.68F}, paints.dark);
    }
  }
  add_canvas_cover(scene, -3.28F, 0.53F, 1.09F, 1.68F, 2.45F, 2.85F, random);
  for (const float x : {2.45F, -1.35F, -2.45F}) {
    for (const float y : {-1.08F, 1.08F}) add_wheel(scene, x, y, 0.52F, 0.3F, paints);
  }
  for (const float side : {-1.0F, 1.0F}) {
    const float y = side * 0.86F;
    mesh.box({2.0F, y - 0.22F, 1.06F}, {3.0F, y + 0.22F, 1.14F}, paints.body);  // mudguard
    mesh.cylinder({3.1F, y, 1.2F}, {3.2F, y, 1.2F}, 0.12F, 0.12F, 12, paints.white);
    mesh.box({0.9F, side * 1.25F - 0.06F, 1.6F}, {1.2F, side * 1.25F + 0.06F, 2.0F}, paints.dark);
    mesh.cylinder({-0.2F, side * 0.9F, 0.75F}, {0.6F, side * 0.9F, 0.75F}, 0.24F, 0.24F, 14,
                  paints.body);  // tanks
  }
  mesh.box({3.2F, -1.0F, 0.62F}, {3.36F, 1.0F, 0.84F}, paints.dark);
  add_number_plate(scene, 3.37F, 0.66F, 1.0F, paints, random);
  add_number_plate(scene, -3.32F, 0.7F, -1.0F, paints, random);
}

void add_army_jeep(Scene& scene, SeededRandom& random) {
  const VehiclePaints paints = army_paints(scene, random);
  MeshBuilder& mesh = scene.mesh;
  static constexpr std::array<BodyStation, 7> kBody = {{
      {1.95F, 0.48F, 0.92F, 0.98F, 0.60F, 0.52F},
      {1.88F, 0.46F, 0.98F, 1.04F, 0.66F, 0.56F},
      {0.72F, 0.45F, 1.06F, 1.13F, 0.72F, 0.62F},
      {0.66F, 0.45F, 1.06F, 1.14F, 0.80F, 0.72F, false, true},
      {0.52F, 0.45F, 1.07F, 1.76F, 0.80F, 0.72F},
      {0.46F, 0.45F, 1.07F, 1.76F, 0.80F, 0.72F},
      {0.44F, 0.45F, 1.07F, 1.70F, 0.80F, 0.72F},
  }};
  add_body(scene, kBody, paints);
  mesh.box({-1.95F, -0.8F, 0.45F}, {0.46F, 0.8F, 1.0F}, paints.body, kSidesNoBottom);
  add_canvas_cover(scene, -1.92F, 0.46F, 0.78F, 0.98F, 1.6F, 1.82F, random);
  for (const float x : {1.2F, -1.25F}) {
    for (const float side : {-1.0F, 1.0F}) {
      add_wheel_arch(scene, x, side * 0.81F, 0.38F, 0.46F, 0.45F, paints);
      add_wheel(scene, x, side * 0.88F, 0.38F, 0.24F, paints);
    }
  }
  for (const float y : {-0.42F, 0.42F}) {
    mesh.cylinder({1.9F, y, 0.82F}, {1.98F, y, 0.82F}, 0.1F, 0.1F, 12, paints.white);
  }
  for (int slot = 0; slot < 7; ++slot) {
    const float y = -0.24F + 0.08F * static_cast<float>(slot);
    mesh.box({1.9F, y - 0.022F, 0.62F}, {1.965F, y + 0.022F, 0.86F}, paints.dark);
  }
  mesh.box({1.95F, -0.75F, 0.44F}, {2.08F, 0.75F, 0.58F}, paints.dark);
  mesh.cylinder({-1.95F, 0.1F, 0.98F}, {-2.15F, 0.1F, 0.98F}, 0.36F, 0.36F, 18, paints.dark);
  add_number_plate(scene, 2.09F, 0.46F, 1.0F, paints, random);
}

}  // namespace km
