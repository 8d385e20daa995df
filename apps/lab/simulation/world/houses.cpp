#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector3f;
using enum Recipe;

constexpr SurfaceClass kBuildingLabel = SurfaceClass::kBuilding;

/// All parameters of a facade.
struct FacadeStyle {
  int floors = 4;  ///< Ground floor included.
  float ground_floor_m = 3.8F;
  float floor_m = 3.0F;
  float bay_m = 2.8F;  ///< Approximate distance between windows: bays divide the width evenly.
  float window_width_m = 1.15F;
  float window_height_m = 1.65F;
  float recess_m = 0.16F;  ///< Depth of the glass behind the wall.
  bool mullion = true;     ///< A bar in the middle of a window.
  bool shops = false;      ///< Shops on the ground floor.
  bool surrounds = false;  ///< Stone frames around windows.
  bool string_courses = true;
  bool cornice = true;
  MaterialId wall = 0;
  MaterialId base = 0;   ///< Wall of the ground floor.
  MaterialId trim = 0;   ///< Sills, surrounds, courses, cornice.
  MaterialId frame = 0;  ///< Window frames.
  MaterialId door = 0;

  /// Height of the bottom of a floor; of the top of the wall for `floors`.
  [[nodiscard]] float bottom(int floor) const {
    return floor == 0 ? 0.0F : ground_floor_m + static_cast<float>(floor - 1) * floor_m;
  }
  [[nodiscard]] float top() const { return bottom(floors); }
};

/// A hole in a wall in the plane y = 0 [m].
struct Opening {
  float x0, x1, z0, z1;
};

/// Walls of one facade, in the plane y = 0 from x = 0.
class Facade {
 public:
  Facade(Scene& scene, const FacadeStyle& style, std::uint64_t seed, float width_m)
      : scene_(scene),
        style_(style),
        random_(SeededRandom::stream(seed, 1)),
        width_(width_m),
        bays_(std::max(1, static_cast<int>(width_m / style.bay_m + 0.5F))) {}

  void add_rich() {
    add_ground_floor();
    for (int floor = 1; floor < style_.floors; ++floor) {
      const float z = style_.bottom(floor);
      const float top = std::min(z + 0.85F + style_.window_height_m, z + style_.floor_m - 0.2F);
      add_floor(z, z + style_.floor_m, style_.window_width_m, z + 0.85F, top);
      if (style_.string_courses) band(z - 0.09F, z + 0.07F, 0.07F);
    }
    if (!style_.cornice) return;
    band(style_.top() - 0.55F, style_.top() - 0.4F, 0.1F);
    band(style_.top() - 0.25F, style_.top() + 0.05F, 0.35F);
  }

  /// A wall with small windows, or with none.
  void add_plain(bool blind) {
    bays_ = std::max(1, static_cast<int>(width_ / 4.2F + 0.5F));
    if (blind) return add_wall(-0.6F, style_.top(), {}, style_.wall);
    for (int floor = 0; floor < style_.floors; ++floor) {
      const float z = style_.bottom(floor);
      add_floor(floor == 0 ? -0.6F : z, style_.bottom(floor + 1), 0.9F, z + 1.1F, z + 2.3F);
    }
  }

 private:
  [[nodiscard]] Opening at_bay(int bay, float width, float z0, float z1) const {
    const float middle = width_ * (static_cast<float>(bay) + 0.5F) / static_cast<float>(bays_);
    return {middle - 0.5F * width, middle + 0.5F * width, z0, z1};
  }

  /// An upright sheet at depth y, facing the street.
  void pane(float x0, float x1, float z0, float z1, float y, MaterialId material) {
    scene_.quad({x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}, material);
  }

  /// A bar from `front` to `back` of the plane y = 0.
  void bar(float x0, float x1, float z0, float z1, float front, float back, MaterialId material) {
    scene_.box({x0, front, z0}, {x1, back, z1}, material, kSidesNoBack);
  }

  void band(float z0, float z1, float out) { bar(0.0F, width_, z0, z1, -out, 0.0F, style_.trim); }

  /// The wall around openings that stand in one row, left to right.
  void add_wall(float z0, float z1, std::span<const Opening> openings, MaterialId wall) {
    float x = 0.0F;
    for (const Opening& o : openings) {
      pane(x, o.x0, z0, z1, 0.0F, wall);
      pane(o.x0, o.x1, z0, o.z0, 0.0F, wall);
      pane(o.x0, o.x1, o.z1, z1, 0.0F, wall);
      x = o.x1;
    }
    pane(x, width_, z0, z1, 0.0F, wall);
  }

  /// The sides of an opening, glass at its back, and a frame around that.
  void add_glazing(const Opening& o, MaterialId wall, float width = 0.055F) {
    const float y = style_.recess_m;
    const auto& [x0, x1, z0, z1] = o;
    scene_.quad({x0, 0, z0}, {x0, y, z0}, {x0, y, z1}, {x0, 0, z1}, wall);
    scene_.quad({x1, y, z0}, {x1, 0, z0}, {x1, 0, z1}, {x1, y, z1}, wall);
    scene_.quad({x0, y, z1}, {x1, y, z1}, {x1, 0, z1}, {x0, 0, z1}, wall);
    scene_.quad({x0, 0, z0}, {x1, 0, z0}, {x1, y, z0}, {x0, y, z0}, wall);
    const float depth = 0.03F + 0.02F * static_cast<float>(random_.below(3));
    pane(x0, x1, z0, z1, y,
         scene_.plain(kBuildingLabel, {depth, 1.1F * depth, 1.25F * depth}, 0.45F));
    const float front = y - 0.045F;
    bar(x0, x1, z0, z0 + width, front, y, style_.frame);
    bar(x0, x1, z1 - width, z1, front, y, style_.frame);
    bar(x0, x0 + width, z0, z1, front, y, style_.frame);
    bar(x1 - width, x1, z0, z1, front, y, style_.frame);
  }

  void add_window(const Opening& o, MaterialId wall) {
    add_glazing(o, wall);
    const float y = style_.recess_m;
    const float middle = 0.5F * (o.x0 + o.x1), height = o.z1 - o.z0;
    if (style_.mullion)
      bar(middle - 0.027F, middle + 0.027F, o.z0, o.z1, y - 0.045F, y, style_.frame);
    const float transom = o.z0 + (style_.mullion ? 0.72F : 0.5F) * height;
    bar(o.x0, o.x1, transom - 0.027F, transom + 0.027F, y - 0.05F, y, style_.frame);
    add_curtains(o);
    bar(o.x0 - 0.07F, o.x1 + 0.07F, o.z0 - 0.08F, o.z0 + 0.012F, -0.09F, 0.0F, style_.trim);
    if (style_.surrounds) {
      bar(o.x0 - 0.16F, o.x0, o.z0, o.z1, -0.045F, 0.0F, style_.trim);
      bar(o.x1, o.x1 + 0.16F, o.z0, o.z1, -0.045F, 0.0F, style_.trim);
      bar(o.x0 - 0.22F, o.x1 + 0.22F, o.z1, o.z1 + 0.2F, -0.07F, 0.0F, style_.trim);
    }
  }

  /// Blinds or curtains: sheets a finger's width before the pane, which is opaque.
  void add_curtains(const Opening& o) {
    const float front = style_.recess_m - 0.012F;
    const float shade = 0.45F + 0.1F * static_cast<float>(random_.below(4));
    const auto cloth =
        scene_.paint(kBuildingLabel, kCurtain, {shade, 0.97F * shade, 0.9F * shade}, 0.5F);
    const int kind = random_.below(6);
    if (kind == 0) {  // a roller blind
      pane(o.x0, o.x1, o.z1 - random_.uniform(0.25F, 0.8F) * (o.z1 - o.z0), o.z1, front, cloth);
    } else if (kind <= 2) {
      const float cover = random_.uniform(0.2F, 0.35F) * (o.x1 - o.x0);
      pane(o.x0, o.x0 + cover, o.z0, o.z1, front, cloth);
      pane(o.x1 - cover, o.x1, o.z0, o.z1, front, cloth);
    }
  }

  void add_floor(float z0, float z1, float width, float window_z0, float window_z1) {
    std::vector<Opening> openings;
    for (int bay = 0; bay < bays_; ++bay)
      openings.push_back(at_bay(bay, width, window_z0, window_z1));
    add_wall(z0, z1, openings, style_.wall);
    for (const Opening& o : openings) add_window(o, style_.wall);
  }

  void add_ground_floor() {
    const int door = random_.below(bays_);
    const float top = style_.ground_floor_m;
    const float bay_m = width_ / static_cast<float>(bays_);
    std::vector<Opening> openings;
    for (int bay = 0; bay < bays_; ++bay) {
      if (bay == door)
        openings.push_back(at_bay(bay, std::min(1.2F, 0.7F * bay_m), 0.16F, 2.75F));
      else if (style_.shops)
        openings.push_back(at_bay(bay, bay_m - 0.5F, 0.45F, top - 0.95F));
      else
        openings.push_back(at_bay(bay, style_.window_width_m, 1.05F,
                                  std::min(1.05F + style_.window_height_m, top - 0.35F)));
    }
    add_wall(-0.6F, top, openings, style_.base);
    for (int bay = 0; bay < bays_; ++bay) {
      const Opening& o = openings[static_cast<std::size_t>(bay)];
      if (bay == door)
        add_door(o);
      else if (style_.shops)
        add_shop(o);
      else
        add_window(o, style_.base);
    }
  }

  /// Two rows of panels below a fanlight, over a step.
  void add_door(const Opening& o) {
    add_glazing(o, style_.base, 0.09F);
    const float y = style_.recess_m;
    const float fanlight = o.z1 - 0.5F;
    bar(o.x0, o.x1, o.z0, fanlight, y - 0.02F, y, style_.door);
    bar(o.x0, o.x1, fanlight - 0.05F, fanlight + 0.05F, y - 0.05F, y, style_.frame);
    const float half = 0.5F * (o.x1 - o.x0);
    for (const float x : {o.x0 + 0.12F, o.x0 + half + 0.04F})
      for (const float z : {o.z0 + 0.2F, o.z0 + 1.1F})
        bar(x, x + half - 0.16F, z, z + 0.75F, y - 0.05F, y, style_.door);
    bar(o.x0 - 0.15F, o.x1 + 0.15F, o.z0 - 0.16F, o.z0, -0.45F, 0.0F, style_.trim);
  }

  /// A window with goods and prints before the pane, which is opaque, below a board with writing.
  void add_shop(const Opening& o) {
    add_glazing(o, style_.base, 0.07F);
    const float y = style_.recess_m;
    for (float x = o.x0 + 0.15F; x < o.x1 - 0.4F; x += random_.uniform(0.16F, 0.5F)) {
      const float height = random_.uniform(0.1F, 0.6F * (o.z1 - o.z0));
      const float shade = 0.1F + 0.12F * static_cast<float>(random_.below(4));
      bar(x, x + 0.15F, o.z0 + 0.07F, o.z0 + height, y - 0.04F, y,
          scene_.plain(kBuildingLabel, {shade, 0.8F * shade, 0.6F * shade}));
    }
    const float u = static_cast<float>(random_.below(4));
    scene_.set_uv_offset({u, static_cast<float>(random_.below(4))});
    if (random_.chance(0.45))
      pane(o.x1 - 0.9F, o.x1 - 0.1F, o.z0 + 0.5F, o.z0 + 1.4F, y - 0.05F,
           scene_.paint(kBuildingLabel, kPosters));
    const Vector3f boards[] = {{1.0F, 0.35F, 0.25F},
                               {0.3F, 0.45F, 1.0F},
                               {0.3F, 0.9F, 0.45F},
                               {1.2F, 1.15F, 1.05F},
                               {1.2F, 0.8F, 0.2F}};
    bar(o.x0, o.x1, style_.ground_floor_m - 0.8F, style_.ground_floor_m - 0.25F, -0.1F, 0.0F,
        scene_.paint(kBuildingLabel, kNewsprint, random_.pick(boards), 12.0F));
    scene_.set_uv_offset(Eigen::Vector2f::Zero());
  }

  Scene& scene_;
  const FacadeStyle& style_;
  SeededRandom random_;
  float width_;
  int bays_;
};

void add_flat_roof(Scene& scene, const House& b, const FacadeStyle& style, SeededRandom& random) {
  const float z = style.top(), w = b.width_m, d = b.depth_m;
  const auto roofing = scene.paint(kBuildingLabel, kGravel, {0.8F, 0.8F, 0.8F});
  scene.quad({0, 0, z}, {w, 0, z}, {w, d, z}, {0, d, z}, roofing);
  for (const float y : {0.0F, d - 0.25F})
    scene.box({0, y, z}, {w, y + 0.25F, z + 0.6F}, style.wall, kSidesNoBottom);
  for (const float x : {0.0F, w - 0.25F})
    scene.box({x, 0.25F, z}, {x + 0.25F, d - 0.25F, z + 0.6F}, style.wall, kSidesNoBottom);
  const auto metal = scene.paint(kBuildingLabel, kPaintedMetal, {0.5F, 0.5F, 0.5F});
  const float x = random.uniform(1.0F, w - 3.0F);
  const float y = random.uniform(1.5F, d - 3.0F);
  scene.box({x, y, z}, {x + 2.0F, y + 1.5F, z + random.uniform(0.8F, 2.2F)}, metal, kSidesNoBottom);
}

void add_ridge_roof(Scene& scene, const House& b, const FacadeStyle& style, SeededRandom& random) {
  constexpr float kEave_m = 0.4F;
  const float w = b.width_m, d = b.depth_m, middle = 0.5F * b.depth_m;
  const float z = style.top();
  const float slope = std::tan(random.uniform(0.6F, 0.85F));
  const float ridge = z + slope * middle;
  const float low = z - slope * kEave_m;
  const auto tiles = scene.paint(kBuildingLabel, kRoofTiles, {0.95F, 0.9F, 0.9F});
  const auto zinc = scene.plain(kBuildingLabel, {0.3F, 0.32F, 0.33F}, 0.05F);
  scene.quad({0, -kEave_m, low}, {w, -kEave_m, low}, {w, middle, ridge}, {0, middle, ridge}, tiles);
  scene.quad({w, d + kEave_m, low}, {0, d + kEave_m, low}, {0, middle, ridge}, {w, middle, ridge},
             tiles);
  scene.quad({w, -kEave_m, low - 0.02F}, {0, -kEave_m, low - 0.02F}, {0, 0, z - 0.02F},
             {w, 0, z - 0.02F}, style.trim);  // soffit
  scene.triangle({0, d, z}, {0, 0, z}, {0, middle, ridge}, style.wall);
  scene.triangle({w, 0, z}, {w, d, z}, {w, middle, ridge}, style.wall);
  scene.cylinder({0, -kEave_m - 0.06F, low}, {w, -kEave_m - 0.06F, low}, 0.08F, 0.08F, 8, zinc);
  const float x = random.uniform(0.1F, 0.8F) * w;
  scene.box({x, middle + 0.4F, ridge - 1.5F}, {x + 0.9F, middle + 1.0F, ridge + 0.9F},
            scene.paint(kBuildingLabel, kBrick), kSidesNoBottom);
}

void choose_walls(Scene& scene, FacadeStyle& style, SeededRandom& random) {
  const int kind = random.below(10);
  const float light = 0.1F * static_cast<float>(random.below(3));
  if (kind <= 2) {
    const float red = 0.8F + light;
    style.wall = scene.paint(kBuildingLabel, kBrick, {red, 0.9F * red, 0.85F * red});
  } else if (kind <= 7) {
    const Vector3f tints[] = {{0.72F, 0.6F, 0.36F}, {0.7F, 0.68F, 0.62F}, {0.62F, 0.38F, 0.28F},
                              {0.45F, 0.5F, 0.42F}, {0.42F, 0.5F, 0.58F}, {0.52F, 0.5F, 0.48F}};
    style.wall = scene.paint(kBuildingLabel, kPlaster, random.pick(tints));
  } else {
    style.wall = scene.paint(kBuildingLabel, kind == 8 ? kStoneBlocks : kConcrete);
  }
  style.base = random.chance(0.4) ? scene.paint(kBuildingLabel, kStoneBlocks) : style.wall;
}

FacadeStyle draw_style(Scene& scene, SeededRandom& random) {
  FacadeStyle style;
  choose_walls(scene, style, random);
  const float stone = random.chance(0.6) ? 0.9F : 0.6F;
  style.trim = scene.paint(kBuildingLabel, kConcrete, {stone, 0.98F * stone, 0.93F * stone});
  style.frame = random.chance(0.7) ? scene.plain(kBuildingLabel, {0.75F, 0.75F, 0.72F})
                                   : scene.plain(kBuildingLabel, {0.16F, 0.1F, 0.06F});
  const Vector3f doors[] = {
      {0.1F, 0.2F, 0.12F}, {0.25F, 0.06F, 0.05F}, {0.08F, 0.12F, 0.25F}, {0.28F, 0.17F, 0.09F}};
  style.door = scene.paint(kBuildingLabel, kPaintedMetal, random.pick(doors));
  style.floors = 3 + random.below(3);
  style.ground_floor_m = random.uniform(3.5F, 4.2F);
  style.floor_m = random.uniform(2.9F, 3.3F);
  style.bay_m = random.uniform(2.1F, 3.1F);
  style.window_width_m = random.uniform(0.95F, 1.3F);
  style.window_height_m = random.uniform(1.45F, 1.8F);
  style.recess_m = random.uniform(0.1F, 0.24F);
  style.mullion = random.chance(0.55);
  style.shops = random.chance(0.45);
  style.surrounds = random.chance(0.4);
  style.string_courses = random.chance(0.6);
  style.cornice = random.chance(0.7);
  return style;
}

}  // namespace

void add_house(Scene& scene, const House& house) {
  SeededRandom random = SeededRandom::stream(house.seed, 4);
  FacadeStyle style = draw_style(scene, random);
  if (house.floors > 0) style.floors = house.floors;
  const float w = house.width_m, d = house.depth_m;
  const Vector3f corners[] = {{0.0F, 0.0F, 0.0F}, {w, 0.0F, 0.0F}, {w, d, 0.0F}, {0.0F, d, 0.0F}};
  const WallKind walls[] = {house.front, house.right, house.back, house.left};
  for (std::size_t side = 0; side < 4; ++side) {
    const auto frame = scene.at(corners[side], 0.5F * kPi * static_cast<float>(side));
    Facade facade(scene, style, house.seed, side % 2 == 0 ? w : d);
    if (walls[side] == WallKind::kRich) facade.add_rich();
    if (walls[side] == WallKind::kPlain) facade.add_plain(false);
    if (walls[side] == WallKind::kBlind) facade.add_plain(true);
  }
  if (house.floors == 0 && random.chance(0.55))
    add_ridge_roof(scene, house, style, random);
  else
    add_flat_roof(scene, house, style, random);
}

}  // namespace km
