#include <cmath>
#include <numbers>

#include "modules/simulation/world/city_blocks.hpp"
#include "modules/simulation/world/people.hpp"
#include "modules/simulation/world/street_furniture.hpp"
#include "modules/simulation/world/vegetation.hpp"
#include "modules/simulation/world/vehicles.hpp"

namespace km {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kParking_m = -kSidewalk_m - 1.05F;  // middle of the parking lane, y of a side
constexpr float kAtKerb_m = -kSidewalk_m + 0.65F;   // where poles and trees stand
constexpr float kAtWall_m = -0.45F;
constexpr float kBay_m = 5.4F;
constexpr float kClearOfCorner_m = 4.6F;

void add_parked_vehicles(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const double occupied = random.uniform(0.4F, 0.9F);
  const float half = 0.5F * kBay_m;
  for (float x = kClearOfCorner_m + half; x < side.length_m - kClearOfCorner_m - half;
       x += kBay_m) {
    if (!random.chance(occupied)) continue;
    const int draw = random.below(10);
    const VehicleKind kind = draw < 3   ? VehicleKind::kSedan
                             : draw < 7 ? VehicleKind::kHatchback
                             : draw < 9 ? VehicleKind::kEstate
                                        : VehicleKind::kVan;
    const float askew = random.uniform(-0.025F, 0.025F);
    const Vector3f at(x + random.uniform(-0.15F, 0.15F), kParking_m + random.uniform(0.0F, 0.12F),
                      -kKerb_m);
    const ScopedFrame frame(scene.mesh, standing_at(at, kPi + askew));
    add_vehicle(scene, kind, random);
  }
}

void add_small_object(Scene& scene, SeededRandom& random) {
  switch (random.below(9)) {
    case 0:
      return add_bin(scene, random);
    case 1:
      return add_hydrant(scene);
    case 2:
      return add_mail_box(scene, random);
    case 3:
      return add_planter(scene, random);
    case 4:
    case 5:
      return add_bollard(scene);
    case 6: {
      const ScopedFrame turned(scene.mesh, standing_at(Vector3f::Zero(), 0.5F * kPi));
      return add_traffic_sign(scene, random);
    }
    default:
      return;
  }
}

void add_along_kerb(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const bool trees = random.chance(0.6);
  const float first = random.uniform(2.0F, 4.0F);
  int slot = 0;
  for (float x = first; x < side.length_m - 1.0F; x += 2.1F, ++slot) {
    const ScopedFrame at(scene.mesh, standing_at({x, kAtKerb_m, 0.0F}, 0.0F));
    if (slot % 8 == 1) {
      add_street_lamp(scene, random);
    } else if (trees && slot % 4 == 3) {
      if (random.chance(0.2)) continue;
      const ScopedFrame turned(scene.mesh,
                               standing_at(Vector3f::Zero(), random.uniform(0.0F, 6.0F)));
      add_tree(scene,
               {.height_m = random.uniform(5.5F, 7.5F), .crown_radius_m = 1.9F, .leaves = 1100},
               random);
    } else if (slot % 2 == 0 && random.chance(0.6)) {
      add_small_object(scene, random);
    }
  }
  const float column_x = random.uniform(0.3F, 0.7F) * side.length_m;
  if (random.chance(0.15)) {
    const ScopedFrame at(scene.mesh, standing_at({column_x, kAtWall_m - 0.5F, 0.0F}, 0.0F));
    add_advertising_column(scene, random);
  }
}

void add_along_wall(Scene& scene, const StreetSide& side, SeededRandom& random) {
  for (float x = random.uniform(2.0F, 8.0F); x < side.length_m - 2.0F;
       x += random.uniform(5.0F, 11.0F)) {
    const ScopedFrame at(scene.mesh, standing_at({x, kAtWall_m, 0.0F}, 0.0F));
    if (random.chance(0.35))
      add_bin(scene, random);
    else if (random.chance(0.4))
      add_bench(scene);
    else if (random.chance(0.4))
      add_planter(scene, random);
  }
  for (float x = random.uniform(1.0F, 14.0F); x < side.length_m; x += random.uniform(6.0F, 18.0F)) {
    const Vector3f at(x, random.uniform(-1.7F, -1.0F), 0.0F);
    const ScopedFrame frame(scene.mesh, standing_at(at, random.uniform(0.0F, 2.0F * kPi)));
    add_person(scene, random);
  }
}

void add_at_corner(Scene& scene, SeededRandom& random) {
  // Traffic on this side drives along -x: its light stands at x = 0 and faces +x.
  const ScopedFrame light(scene.mesh, standing_at({0.4F, -kSidewalk_m + 0.4F, 0.0F}, 0.5F * kPi));
  add_traffic_light(scene);
  const ScopedFrame back(scene.mesh, standing_at({-1.2F, 0.0F, 0.0F}, 0.0F));
  if (random.chance(0.5)) add_traffic_sign(scene, random);
}

}  // namespace

void add_sidewalk_objects(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const ScopedFrame frame(scene.mesh, side.T_world_side);
  add_parked_vehicles(scene, side, random);
  add_along_kerb(scene, side, random);
  add_along_wall(scene, side, random);
  add_at_corner(scene, random);
}

}  // namespace km
