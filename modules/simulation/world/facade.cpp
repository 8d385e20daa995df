#include "modules/simulation/world/facade.hpp"

#include <algorithm>
#include <vector>

#include "modules/simulation/world/openings.hpp"

namespace km {
namespace {

using Eigen::Vector3f;

/// How the width is cut into bays.
struct Bays {
  int count = 0;
  float width_m = 0.0F;

  [[nodiscard]] float middle(int bay) const { return (static_cast<float>(bay) + 0.5F) * width_m; }
};

Bays bays_of(const FacadeStyle& style, float width_m) {
  const int count = std::max(1, static_cast<int>(width_m / style.bay_m + 0.5F));
  return {count, width_m / static_cast<float>(count)};
}

float floor_bottom(const FacadeStyle& style, int floor) {
  return floor == 0 ? 0.0F : style.ground_floor_m + static_cast<float>(floor - 1) * style.floor_m;
}

Opening centred(float middle, float width, float z0, float z1) {
  return {middle - 0.5F * width, middle + 0.5F * width, z0, z1};
}

void add_band(Scene& scene, float width_m, float z0, float z1, float out, MaterialId material) {
  scene.mesh.box({0.0F, -out, z0}, {width_m, 0.0F, z1}, material, kSidesNoBack);
}

void add_balcony(Scene& scene, float middle, float z, float width, const FacadeStyle& style) {
  MeshBuilder& mesh = scene.mesh;
  const float x0 = middle - 0.5F * width;
  const float x1 = middle + 0.5F * width;
  const float depth = 0.95F;
  mesh.box({x0, -depth, z - 0.18F}, {x1, 0.0F, z}, style.trim, kSidesNoBack);
  const MaterialId iron = scene.plain(SurfaceClass::kBuilding, 0.04F, 0.045F, 0.05F);
  const float top = z + 1.0F;
  const auto rail = [&](const Vector3f& low, const Vector3f& high) {
    mesh.box(low, high, iron, kSidesAll);
  };
  rail({x0, -depth, top - 0.05F}, {x1, -depth + 0.05F, top});
  rail({x0, -depth + 0.05F, top - 0.05F}, {x0 + 0.05F, 0.0F, top});
  rail({x1 - 0.05F, -depth + 0.05F, top - 0.05F}, {x1, 0.0F, top});
  const int bars = static_cast<int>(width / 0.13F);
  for (int i = 0; i <= bars; ++i) {
    const float x =
        x0 + 0.015F + (width - 0.03F) * static_cast<float>(i) / static_cast<float>(bars);
    mesh.box({x - 0.012F, -depth + 0.012F, z}, {x + 0.012F, -depth + 0.036F, top - 0.05F}, iron,
             kSidesAround);
  }
  for (const float x : {x0 + 0.012F, x1 - 0.036F}) {
    for (float y = -depth + 0.15F; y < -0.05F; y += 0.13F) {
      mesh.box({x, y, z}, {x + 0.024F, y + 0.024F, top - 0.05F}, iron, kSidesAround);
    }
  }
}

void add_awning(Scene& scene, float x0, float x1, float z, SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  const float out = 1.1F;
  const float drop = 0.45F;
  const float hue = random.uniform(0.0F, 1.0F);
  const MaterialId plain =
      scene.paint(SurfaceClass::kBuilding, Recipe::kCanvas, {0.75F, 0.72F, 0.65F});
  const Eigen::Vector3f tint = hue < 0.4F   ? Eigen::Vector3f(0.5F, 0.07F, 0.05F)
                               : hue < 0.7F ? Eigen::Vector3f(0.05F, 0.25F, 0.12F)
                                            : Eigen::Vector3f(0.08F, 0.15F, 0.4F);
  const MaterialId coloured = scene.paint(SurfaceClass::kBuilding, Recipe::kCanvas, tint);
  const int stripes = std::max(2, static_cast<int>((x1 - x0) / 0.3F));
  for (int i = 0; i < stripes; ++i) {
    const float a = x0 + (x1 - x0) * static_cast<float>(i) / static_cast<float>(stripes);
    const float b = x0 + (x1 - x0) * static_cast<float>(i + 1) / static_cast<float>(stripes);
    const MaterialId cloth = i % 2 == 0 ? coloured : plain;
    mesh.quad({a, -out, z - drop}, {b, -out, z - drop}, {b, 0.0F, z}, {a, 0.0F, z}, cloth);
    mesh.quad({b, -out, z - drop - 0.01F}, {a, -out, z - drop - 0.01F}, {a, 0.0F, z - 0.01F},
              {b, 0.0F, z - 0.01F}, cloth);
    mesh.quad({a, -out, z - drop - 0.22F}, {b, -out, z - drop - 0.22F}, {b, -out, z - drop},
              {a, -out, z - drop}, cloth);
  }
}

void add_ground_floor(Scene& scene, const FacadeStyle& style, const Bays& bays, float width_m,
                      SeededRandom& random) {
  const int door_bay = random.below(bays.count);
  const float top = style.ground_floor_m;
  std::vector<Opening> openings;
  for (int bay = 0; bay < bays.count; ++bay) {
    const float middle = bays.middle(bay);
    if (bay == door_bay) {
      openings.push_back(centred(middle, std::min(1.2F, 0.7F * bays.width_m), 0.16F, 2.75F));
    } else if (style.ground_floor == GroundFloor::kShops) {
      openings.push_back(centred(middle, bays.width_m - 0.5F, 0.02F, top - 0.95F));
    } else if (style.ground_floor == GroundFloor::kGarages) {
      openings.push_back(centred(middle, std::min(2.6F, bays.width_m - 0.4F), 0.02F, 2.4F));
    } else {
      openings.push_back(centred(middle, style.window_width_m, 1.05F,
                                 std::min(1.05F + style.window_height_m, top - 0.35F)));
    }
  }
  add_pierced_wall(scene, width_m, -0.6F, top, openings, style.base);
  FacadeStyle at_base = style;
  at_base.wall = style.base;
  at_base.shutters = false;
  for (int bay = 0; bay < bays.count; ++bay) {
    const Opening& o = openings[static_cast<std::size_t>(bay)];
    if (bay == door_bay) {
      add_door(scene, o, at_base, random);
    } else if (style.ground_floor == GroundFloor::kShops) {
      add_shop_front(scene, o, style, bay % 2 == 0, random);
      if (random.chance(0.75)) {
        add_sign_board(scene, o.x0, top - 0.8F, o.width(), 0.55F, SurfaceClass::kBuilding, random);
      }
      if (random.chance(0.4)) add_awning(scene, o.x0, o.x1, top - 0.85F, random);
    } else if (style.ground_floor == GroundFloor::kGarages) {
      add_garage_door(scene, o, style, random);
    } else {
      add_window(scene, o, at_base, random);
    }
  }
}

void add_upper_floor(Scene& scene, const FacadeStyle& style, const Bays& bays, float width_m,
                     int floor, SeededRandom& random) {
  const float bottom = floor_bottom(style, floor);
  const auto has_balcony = [&](int bay) {
    return style.balconies && bay % 3 == 1 && bays.width_m > 1.9F;
  };
  std::vector<Opening> openings;
  for (int bay = 0; bay < bays.count; ++bay) {
    const float z0 = bottom + (has_balcony(bay) ? 0.06F : style.sill_m);
    const float z1 = bottom + style.sill_m + style.window_height_m;
    openings.push_back(centred(bays.middle(bay), style.window_width_m, z0,
                               std::min(z1, bottom + style.floor_m - 0.2F)));
  }
  add_pierced_wall(scene, width_m, bottom, bottom + style.floor_m, openings, style.wall);
  for (int bay = 0; bay < bays.count; ++bay) {
    FacadeStyle here = style;
    if (has_balcony(bay)) here.shutters = false;
    add_window(scene, openings[static_cast<std::size_t>(bay)], here, random);
    if (has_balcony(bay)) {
      add_balcony(scene, bays.middle(bay), bottom, std::min(bays.width_m - 0.2F, 2.6F), style);
    }
  }
}

void add_cornice(Scene& scene, const FacadeStyle& style, float width_m) {
  const float top = height_m(style);
  add_band(scene, width_m, top - 0.55F, top - 0.4F, 0.1F, style.trim);
  add_band(scene, width_m, top - 0.25F, top + 0.05F, 0.35F, style.trim);
  const int corbels = std::max(2, static_cast<int>(width_m / 0.7F));
  for (int i = 0; i < corbels; ++i) {
    const float x = width_m * (static_cast<float>(i) + 0.5F) / static_cast<float>(corbels);
    scene.mesh.box({x - 0.08F, -0.3F, top - 0.4F}, {x + 0.08F, 0.0F, top - 0.25F}, style.trim,
                   kSidesNoBack);
  }
}

void add_downpipe(Scene& scene, const FacadeStyle& style) {
  const MaterialId zinc = scene.plain(SurfaceClass::kBuilding, 0.3F, 0.32F, 0.33F, 0.05F);
  const float top = height_m(style) - 0.3F;
  scene.mesh.cylinder({0.22F, -0.1F, -0.2F}, {0.22F, -0.1F, top}, 0.055F, 0.055F, 8, zinc, false);
  for (float z = 1.0F; z < top; z += 2.0F) {
    scene.mesh.box({0.145F, -0.165F, z}, {0.295F, 0.0F, z + 0.05F}, zinc, kSidesNoBack);
  }
}

}  // namespace

float height_m(const FacadeStyle& style) {
  return floor_bottom(style, style.floors);
}

void add_facade(Scene& scene, const FacadeStyle& style, float width_m) {
  SeededRandom random = SeededRandom::stream(style.seed, 1);
  const Bays bays = bays_of(style, width_m);
  add_ground_floor(scene, style, bays, width_m, random);
  for (int floor = 1; floor < style.floors; ++floor) {
    add_upper_floor(scene, style, bays, width_m, floor, random);
    if (style.string_courses) {
      const float z = floor_bottom(style, floor);
      add_band(scene, width_m, z - 0.09F, z + 0.07F, 0.07F, style.trim);
    }
  }
  if (style.cornice) add_cornice(scene, style, width_m);
  if (style.downpipe) add_downpipe(scene, style);
}

void add_plain_facade(Scene& scene, const FacadeStyle& style, float width_m, bool blind) {
  SeededRandom random = SeededRandom::stream(style.seed, 2);
  FacadeStyle plain = style;
  plain.surrounds = plain.shutters = false;
  plain.window_width_m = 0.9F;
  const Bays bays = bays_of({.bay_m = 4.2F}, width_m);
  for (int floor = 0; floor < style.floors; ++floor) {
    const float bottom = floor_bottom(style, floor);
    const float top = floor_bottom(style, floor + 1);
    std::vector<Opening> openings;
    for (int bay = 0; bay < bays.count && !blind; ++bay) {
      openings.push_back(centred(bays.middle(bay), 0.9F, bottom + 1.1F, bottom + 2.3F));
    }
    add_pierced_wall(scene, width_m, floor == 0 ? -0.6F : bottom, top, openings, style.wall);
    for (const Opening& o : openings) add_window(scene, o, plain, random);
  }
}

}  // namespace km
