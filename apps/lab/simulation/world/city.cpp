#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::AlignedBox2f;
using Eigen::Isometry3f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

// Cross-section of every street, from its centre line outwards [m].
constexpr float kLaneOffset_m = 0.5F * kLanesApart_m;
constexpr float kHalfRoad_m = 5.2F;  // the kerb
constexpr float kSidewalk_m = 2.8F;  // width with the kerb stone
constexpr float kKerb_m = 0.12F;     // height of the sidewalk above the road
constexpr int kBlocks = 3;
constexpr double kStreetSpeed_mps = 8.0;

/// One side of a street between two crossings. Frame: x along the building line, left to right seen
/// from the street, which lies at negative y; z = 0 is the sidewalk.
struct StreetSide {
  Isometry3f T_world_side = Isometry3f::Identity();
  float length_m = 0.0F;
};

AlignedBox2f shrunk(const AlignedBox2f& box, float by) {
  return {box.min() + Vector2f::Constant(by), box.max() - Vector2f::Constant(by)};
}

StreetSide street_side(float x, float y, int turns, float length_m) {
  return {standing_at({x, y, kKerb_m}, 0.5F * kPi * static_cast<float>(turns)), length_m};
}

/// South, east, north, west side of a block bounded by kerbs.
std::array<StreetSide, 4> sides_of(const AlignedBox2f& kerb) {
  const AlignedBox2f b = shrunk(kerb, kSidewalk_m);
  const float width = b.sizes().x(), depth = b.sizes().y();
  return {street_side(b.min().x(), b.min().y(), 0, width),
          street_side(b.max().x(), b.min().y(), 1, depth),
          street_side(b.max().x(), b.max().y(), 2, width),
          street_side(b.min().x(), b.max().y(), 3, depth)};
}

/// A grid of streets around 3 x 3 blocks, with houses around it that close the view.
struct CityPlan {
  std::array<float, 4> x{};       ///< Centre lines of the streets along y [m].
  std::array<float, 4> y{};       ///< Centre lines of the streets along x [m].
  std::array<float, 4> phases{};  ///< Phases of the ground's waves [rad].

  explicit CityPlan(std::uint64_t seed) {
    SeededRandom random = SeededRandom::stream(seed, 10);
    // The outer columns are equally wide: the same row of houses fits into both.
    const float outer = random.uniform(58.0F, 62.0F);
    const float inner = random.uniform(60.0F, 66.0F);
    x = {-outer - 0.5F * inner, -0.5F * inner, 0.5F * inner, outer + 0.5F * inner};
    y[0] = -70.0F;
    for (std::size_t i = 1; i < 4; ++i) y[i] = y[i - 1] + random.uniform(44.0F, 49.0F);
    for (float& phase : phases) phase = random.uniform(0.0F, kTwoPi);
  }

  /// Kerb line of a block; column and row 0 .. 2.
  [[nodiscard]] AlignedBox2f block(int column, int row) const {
    const auto i = static_cast<std::size_t>(column), j = static_cast<std::size_t>(row);
    return shrunk({Vector2f(x[i], y[j]), Vector2f(x[i + 1], y[j + 1])}, kHalfRoad_m);
  }
  /// Kerb lines of the ground around the grid.
  [[nodiscard]] std::array<AlignedBox2f, 4> surroundings() const {
    constexpr float kWidth_m = 60.0F;
    const Vector2f low(x[0] - kHalfRoad_m, y[0] - kHalfRoad_m);
    const Vector2f high(x[3] + kHalfRoad_m, y[3] + kHalfRoad_m);
    const Vector2f far_low = low.array() - kWidth_m, far_high = high.array() + kWidth_m;
    return {AlignedBox2f(far_low, Vector2f(far_high.x(), low.y())),
            AlignedBox2f(Vector2f(far_low.x(), high.y()), far_high),
            AlignedBox2f(Vector2f(far_low.x(), low.y()), Vector2f(low.x(), high.y())),
            AlignedBox2f(Vector2f(high.x(), low.y()), Vector2f(far_high.x(), high.y()))};
  }
  /// Sides of the surroundings that face the grid, one for each side of a block there.
  [[nodiscard]] std::vector<StreetSide> outer_sides() const {
    constexpr float kOut_m = kHalfRoad_m + kSidewalk_m;
    std::vector<StreetSide> sides;
    const auto add = [&](float px, float py, int turns, float length) {
      sides.push_back(street_side(px, py, turns, length - 2.0F * kOut_m));
    };
    for (std::size_t i = 0; i < 3; ++i) {
      add(x[i] + kOut_m, y[3] + kOut_m, 0, x[i + 1] - x[i]);
      add(x[0] - kOut_m, y[i] + kOut_m, 1, y[i + 1] - y[i]);
      add(x[i + 1] - kOut_m, y[0] - kOut_m, 2, x[i + 1] - x[i]);
      add(x[3] + kOut_m, y[i + 1] - kOut_m, 3, y[i + 1] - y[i]);
    }
    return sides;
  }
  /// Gentle waves under the whole city [m], slopes below 3 %.
  [[nodiscard]] double ground(double px, double py) const {
    constexpr double kCycle = 2.0 * std::numbers::pi;
    return 0.32 * std::sin(kCycle * px / 128.0 + phases[0]) +
           0.28 * std::sin(kCycle * py / 104.0 + phases[1]) +
           0.06 * std::sin(kCycle * (px + py) / 41.0 + phases[2]) +
           0.05 * std::sin(kCycle * (px - 1.3 * py) / 37.0 + phases[3]);
  }
  /// Closed right-hand ways over the grid. Each drives one street twice in the same direction.
  [[nodiscard]] std::vector<Route> routes() const {
    // They start on the first street, where a vehicle may stand.
    return crossing_routes(x, y, {0.7, 0.3}, static_cast<double>(kLaneOffset_m), kStreetSpeed_mps);
  }
};

/// A level rectangle in cells that are small enough to follow the ground's waves.
void add_ground(Scene& scene, const AlignedBox2f& box, float z, MaterialId material) {
  const auto cells = [](float length) { return std::max(1, static_cast<int>(length / 2.0F)); };
  const int columns = cells(box.sizes().x()), rows = cells(box.sizes().y());
  const auto point = [&](float row, float column) {
    return Vector3f(box.min().x() + box.sizes().x() * column / static_cast<float>(columns),
                    box.min().y() + box.sizes().y() * row / static_cast<float>(rows), z);
  };
  scene.sheet(rows, columns, point, material, true);
}

/// The kerb around a block, its sidewalk and the grass within.
void add_block_ground(Scene& scene, const AlignedBox2f& kerb) {
  const auto stone = scene.paint(SurfaceClass::kSidewalk, kConcrete, {1.1F, 1.1F, 1.1F}, 0.5F);
  constexpr float kLayer_m = 0.004F;
  add_ground(scene, kerb, kKerb_m - kLayer_m, stone);
  add_ground(scene, shrunk(kerb, 0.18F), kKerb_m, scene.paint(SurfaceClass::kSidewalk, kPavers));
  add_ground(scene, shrunk(kerb, kSidewalk_m - 0.05F), kKerb_m + kLayer_m,
             scene.paint(SurfaceClass::kTerrain, kGrass));
  for (const StreetSide& side : sides_of(kerb)) {
    const auto frame = scene.at(side.T_world_side);
    const float length = side.length_m + 2.0F * kSidewalk_m;
    const int cells = static_cast<int>(length / 2.0F);
    const auto point = [&](int row, float column) {
      return Vector3f(length * column / static_cast<float>(cells) - kSidewalk_m, -kSidewalk_m,
                      row == 0 ? -0.2F : -0.004F);
    };
    scene.sheet(1, cells, point, stone);
  }
}

/// Paint and wear of a street from crossing to crossing: x along it, y to the left.
class StreetSurface {
 public:
  explicit StreetSurface(Scene& scene)
      : scene_(scene),
        white_(scene.paint(SurfaceClass::kRoad, kPlaster, {0.78F, 0.78F, 0.75F})),
        patch_(scene.paint(SurfaceClass::kRoad, kAsphalt, {0.62F, 0.62F, 0.64F}, 0.7F)),
        iron_(scene.paint(SurfaceClass::kRoad, kPaintedMetal, {0.13F, 0.12F, 0.11F}, 0.3F)) {}

  void add_markings(float length) {
    const float first = kHalfRoad_m + 1.2F;
    const float last = length - kHalfRoad_m - 4.2F;
    for (const float x : {first, last})  // crosswalks and stop lines
      for (float y = -kHalfRoad_m + 0.35F; y < kHalfRoad_m - 0.5F; y += 1.0F)
        line(x, x + 3.0F, y, y + 0.5F);
    line(first + 3.5F, first + 3.9F, 0.2F, 2.9F);
    line(last - 0.9F, last - 0.5F, -2.9F, -0.2F);
    const float begin = first + 4.6F;
    const float end = last - 1.6F;
    for (float x = begin; x + 2.0F < end; x += 4.0F) line(x, x + 2.0F, -0.065F, 0.065F);
    for (const float side : {-1.0F, 1.0F}) {
      for (float x = begin; x < end - 0.3F; x += 5.4F) {  // parking bays
        line(x, std::min(x + 5.4F, end), side * 3.1F - 0.05F, side * 3.1F + 0.05F);
        line(x, x + 0.1F, side * 4.15F - 0.95F, side * 4.15F + 0.95F);
      }
    }
  }

  /// Repairs of the asphalt, manholes, drains at the kerb.
  void add_wear(float length, SeededRandom& random) {
    for (int i = 2 + random.below(4); i > 0; --i) {
      const float x = random.uniform(12.0F, length - 15.0F);
      const float y = random.uniform(-2.9F, 1.4F);
      const float width = random.uniform(0.5F, 1.5F);
      const float piece = random.uniform(0.8F, 3.5F);
      plate(x, x + piece, y, y + width, 0.0035F, patch_);
    }
    for (int i = 2 + random.below(2); i > 0; --i) {
      const float x = random.uniform(10.0F, length - 10.0F);
      const Vector3f at(x, random.uniform(-2.6F, 2.6F), -0.05F);
      scene_.cylinder(at, at + Vector3f(0.0F, 0.0F, 0.058F), 0.36F, 0.36F, 20, iron_);
    }
    for (float x = 14.0F; x < length - 12.0F; x += random.uniform(14.0F, 20.0F))
      for (const float y : {-kHalfRoad_m + 0.05F, kHalfRoad_m - 0.4F})
        plate(x, x + 0.5F, y, y + 0.35F, 0.005F, iron_);
  }

 private:
  void line(float x0, float x1, float y0, float y1) { plate(x0, x1, y0, y1, 0.006F, white_); }
  void plate(float x0, float x1, float y0, float y1, float z, MaterialId material) {
    scene_.box({x0, y0, -0.05F}, {x1, y1, z}, material, kSideTop);
  }

  Scene& scene_;
  MaterialId white_, patch_, iron_;
};

void add_streets(Scene& scene, const CityPlan& plan, SeededRandom& random) {
  const auto asphalt = scene.paint(SurfaceClass::kRoad, kAsphalt);
  StreetSurface surface(scene);
  const auto add_street = [&](const Vector3f& from, float yaw, float length) {
    const auto frame = scene.at(from, yaw);
    surface.add_markings(length);
    surface.add_wear(length, random);
  };
  const float half = kHalfRoad_m + 0.1F;
  for (std::size_t i = 0; i < 4; ++i) {
    const float x = plan.x[i], y = plan.y[i];
    add_ground(scene, {Vector2f(plan.x[0] - half, y - half), Vector2f(plan.x[3] + half, y + half)},
               0.0F, asphalt);
    for (std::size_t j = 0; j < 3; ++j) {
      add_ground(scene,
                 {Vector2f(x - half, plan.y[j] + half), Vector2f(x + half, plan.y[j + 1] - half)},
                 0.0F, asphalt);
      add_street({plan.x[j], y, 0.0F}, 0.0F, plan.x[j + 1] - plan.x[j]);
      add_street({x, plan.y[j], 0.0F}, 0.5F * kPi, plan.y[j + 1] - plan.y[j]);
    }
  }
}

/// `count` props of `length_m` each, more densely if the length is not a multiple.
void add_fence(Scene& scene, Prop prop, float length, SeededRandom& random) {
  const int pieces = static_cast<int>(std::ceil(length / 2.4F));
  const float step = (length - 2.4F) / std::max(1.0F, static_cast<float>(pieces - 1));
  for (int i = 0; i < pieces; ++i)
    scene.at({step * static_cast<float>(i), 0.0F, 0.0F}).add(add_prop, prop, random);
}

void add_park(Scene& scene, const AlignedBox2f& kerb, SeededRandom& random) {
  for (const StreetSide& side : sides_of(kerb)) {  // with a gate in the middle
    const float half = 0.5F * side.length_m - 2.0F;
    for (const float x : {0.3F, half + 4.0F}) {
      const auto frame = scene.at(side.T_world_side * standing_at({x, 0.3F, 0.0F}));
      if (side.length_m > 40.0F)
        add_hedge(scene, half - 0.3F, 1.1F, random);
      else
        add_fence(scene, Prop::kRailing, half - 0.3F, random);
    }
  }
  const auto middle = scene.at({kerb.center().x(), kerb.center().y(), kKerb_m});
  const Vector2f half = 0.5F * kerb.sizes() - Vector2f::Constant(kSidewalk_m);
  const auto gravel = scene.paint(SurfaceClass::kTerrain, kGravel);
  add_ground(scene, {Vector2f(-half.x(), -1.3F), Vector2f(half.x(), 1.3F)}, 0.012F, gravel);
  add_ground(scene, {Vector2f(-1.3F, -half.y()), Vector2f(1.3F, half.y())}, 0.016F, gravel);
  add_prop(scene, Prop::kMonument, random);
  for (int arm = 0; arm < 4; ++arm) {
    const auto path = scene.at(Vector3f::Zero(), 0.5F * kPi * static_cast<float>(arm));
    for (const float x : {5.5F, 9.0F})
      scene.at({x, 1.8F, 0.0F}).add(add_prop, Prop::kBench, random);
    scene.at({7.2F, -1.8F, 0.0F}, kPi).add(add_prop, Prop::kStreetLamp, random);
    const float along = random.uniform(4.0F, 12.0F);
    scene.at({along, random.uniform(-0.9F, 0.9F), 0.0F}).add(add_person, random);
  }
  // Trees on a jittered grid, off the paths and the monument.
  for (float x = -half.x() + 4.0F; x < half.x() - 3.0F; x += 6.5F) {
    for (float y = -half.y() + 3.5F; y < half.y() - 2.5F; y += 6.0F) {
      const float px = x + random.uniform(-1.2F, 1.2F);
      const float py = y + random.uniform(-1.0F, 1.0F);
      if (std::min(std::abs(px), std::abs(py)) < 2.2F || std::hypot(px, py) < 5.0F) continue;
      const auto at = scene.at({px, py, 0.0F}, random.uniform(0.0F, 6.0F));
      const int kind = random.below(5);
      if (kind <= 2)
        add_tree(scene, random.uniform(6.5F, 10.0F), random);
      else if (kind == 3)
        add_conifer(scene, random.uniform(5.0F, 8.0F), random);
      else
        add_bush(scene, random.uniform(0.7F, 1.3F), random);
    }
  }
}

constexpr float kHouseDepth_m = 11.0F;

/// The houses along one side, 9 to 14 m each, or all equal; those at its ends have a facade to a
/// second street.
void add_row(Scene& scene, const StreetSide& side, bool outer, bool terrace, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 20);
  const float equal = side.length_m / std::max(1.0F, std::floor(side.length_m / 9.0F));
  for (float x = 0.0F; x < side.length_m - 1.0F;) {
    const float left = side.length_m - x;
    House house{.seed = terrace ? seed : ++seed, .depth_m = kHouseDepth_m};
    house.width_m = terrace ? equal : left < 20.0F ? left : random.uniform(9.0F, 14.0F);
    if (!outer && x == 0.0F) house.left = WallKind::kRich;
    if (!outer && house.width_m > left - 1.0F) house.right = WallKind::kRich;
    if (outer) house.back = WallKind::kNone;
    scene.at(side.T_world_side * standing_at({x, 0.0F, 0.0F})).add(add_house, house);
    x += house.width_m;
  }
}

/// A short side between the two rows of a block: a house or a fenced garden.
void add_short_side(Scene& scene, const StreetSide& side, std::uint64_t seed,
                    SeededRandom& random) {
  const float length = side.length_m - 2.0F * kHouseDepth_m;
  const auto frame = scene.at(side.T_world_side * standing_at({kHouseDepth_m, 0.0F, 0.0F}));
  if (random.chance(0.5)) {
    add_house(scene, {.seed = seed, .width_m = length, .depth_m = 9.0F, .back = WallKind::kNone});
    return;
  }
  if (random.chance(0.5))
    add_fence(scene, Prop::kPlankFence, length, random);
  else
    add_hedge(scene, length, 1.5F, random);
  for (const float x : {0.3F * length, 0.75F * length}) {
    scene.at({x, random.uniform(2.8F, 7.0F), 0.0F})
        .add(add_tree, random.uniform(6.0F, 8.5F), random);
    scene.at({x - 1.5F, random.uniform(1.5F, 7.0F), 0.0F})
        .add(add_bush, random.uniform(0.5F, 0.9F), random);
  }
}

void add_blocks(Scene& scene, const CityPlan& plan, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 23);
  const std::uint64_t terrace_seed = seed * 7 + 3;  // one terrace of equal houses for three streets
  for (int column = 0; column < kBlocks; ++column) {
    for (int row = 0; row < kBlocks; ++row) {
      const AlignedBox2f kerb = plan.block(column, row);
      add_block_ground(scene, kerb);
      if (column == 1 && row == 1) {
        add_park(scene, kerb, random);
        continue;
      }
      const auto sides = sides_of(kerb);
      const auto block_seed = 1000 * seed + static_cast<std::uint64_t>(300 * column + 100 * row);
      const bool south = column != 1 && row == 1, north = column == 2 && row == 0;
      add_row(scene, sides[0], false, south, south ? terrace_seed : block_seed);
      add_row(scene, sides[2], false, north, north ? terrace_seed : block_seed + 20);
      for (const std::size_t side : {1U, 3U})
        add_short_side(scene, sides[side], block_seed + 40 + side, random);
    }
  }
  for (const AlignedBox2f& kerb : plan.surroundings()) add_block_ground(scene, kerb);
  std::uint64_t outer_seed = 1000 * seed + 900;
  for (const StreetSide& side : plan.outer_sides()) {
    // Also opposite the ends of the streets, and a tower behind.
    constexpr float kBeyond_m = kHalfRoad_m + kSidewalk_m;
    const auto frame = scene.at(side.T_world_side * standing_at({-kBeyond_m, 0.0F, 0.0F}));
    outer_seed += 20;
    add_row(scene, {Isometry3f::Identity(), side.length_m + 2.0F * kBeyond_m}, true, false,
            outer_seed);
    const House tower{.seed = outer_seed,
                      .width_m = 16.0F,
                      .depth_m = 12.0F,
                      .floors = 8 + random.below(5),
                      .front = WallKind::kPlain,
                      .back = WallKind::kNone};
    scene.at({random.uniform(5.0F, 30.0F), 22.0F, 0.0F}).add(add_house, tower);
  }
}

void add_parked_cars(Scene& scene, float length, SeededRandom& random) {
  constexpr float kBay_m = 5.4F;
  const double occupied = random.uniform(0.4F, 0.9F);
  for (float x = 7.3F; x < length - 7.3F; x += kBay_m) {
    if (!random.chance(occupied)) continue;
    const float askew = random.uniform(-0.025F, 0.025F);
    const float y = -kSidewalk_m - 1.05F + random.uniform(0.0F, 0.12F);
    scene.at({x + random.uniform(-0.15F, 0.15F), y, -kKerb_m}, kPi + askew).add(add_car, random);
  }
}

void add_sidewalk_objects(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const auto frame = scene.at(side.T_world_side);
  add_parked_cars(scene, side.length_m, random);
  constexpr Prop kAtKerb[] = {Prop::kBin, Prop::kHydrant, Prop::kPlanter, Prop::kRoundSign,
                              Prop::kNameSign};
  const bool trees = random.chance(0.6);
  int slot = 0;
  for (float x = random.uniform(2.0F, 4.0F); x < side.length_m - 1.0F; x += 2.1F, ++slot) {
    const auto at = scene.at({x, -kSidewalk_m + 0.65F, 0.0F});
    if (slot % 8 == 1)
      add_prop(scene, Prop::kStreetLamp, random);
    else if (trees && slot % 4 == 3)
      add_tree(scene, random.uniform(5.5F, 7.5F), random);
    else if (slot % 2 == 0 && random.chance(0.5))
      add_prop(scene, random.pick(kAtKerb), random);
  }
  constexpr Prop kAtWall[] = {Prop::kBin, Prop::kBench, Prop::kPlanter, Prop::kAdvertisingColumn};
  for (float x = random.uniform(2.0F, 8.0F); x < side.length_m - 2.0F;
       x += random.uniform(6.0F, 14.0F))
    scene.at({x, -0.7F, 0.0F}).add(add_prop, random.pick(kAtWall), random);
  for (float x = random.uniform(1.0F, 14.0F); x < side.length_m; x += random.uniform(6.0F, 18.0F)) {
    const Vector3f at(x, random.uniform(-1.9F, -1.4F), 0.0F);
    scene.at(at, random.uniform(0.0F, kTwoPi)).add(add_person, random);
  }
  // Traffic on this side drives along -x: its light stands at x = 0 and faces +x.
  scene.at({0.4F, -kSidewalk_m + 0.4F, 0.0F}, 0.5F * kPi)
      .add(add_prop, Prop::kTrafficLight, random);
}

Lighting daylight(std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 30);
  const float azimuth = random.uniform(0.0F, 6.28F);
  const float elevation = random.uniform(0.75F, 1.0F);
  Lighting lighting;
  lighting.to_sun = {std::cos(elevation) * std::cos(azimuth),
                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
  lighting.to_sun.normalize();
  lighting.sun = 0.8F;
  lighting.ambient = 0.32F;
  lighting.haze_distance_m = 900.0F;
  return lighting;
}

}  // namespace

World make_city(std::uint64_t seed) {
  const CityPlan plan(seed);
  Scene scene(seed);
  SeededRandom random = SeededRandom::stream(seed, 31);
  add_streets(scene, plan, random);
  add_blocks(scene, plan, seed);
  for (int column = 0; column < kBlocks; ++column)
    for (int row = 0; row < kBlocks; ++row)
      for (const StreetSide& side : sides_of(plan.block(column, row)))
        add_sidewalk_objects(scene, side, random);
  for (const StreetSide& side : plan.outer_sides()) add_sidewalk_objects(scene, side, random);

  World world;
  world.name = "city";
  scene.move_to(world);
  // Everything moves vertically with the ground, so that walls stay upright.
  for (Vector3f& p : world.mesh.vertices) p.z() += static_cast<float>(plan.ground(p.x(), p.y()));
  world.lighting = daylight(seed);
  world.ground_height = [plan](double x, double y) { return plan.ground(x, y); };
  world.routes = plan.routes();
  return world;
}

}  // namespace km
