#include "apps/lab/simulation/world/buildings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

constexpr SurfaceClass kBuildingLabel = SurfaceClass::kBuilding;
constexpr float kBar = 0.055F;  // width of a window's bars [m]

/// A hole in a wall in the plane y = 0 [m].
struct Opening {
  float x0 = 0.0F;
  float x1 = 0.0F;
  float z0 = 0.0F;
  float z1 = 0.0F;

  [[nodiscard]] float width() const { return x1 - x0; }
  [[nodiscard]] float height() const { return z1 - z0; }
};

MaterialId glass(Scene& scene, SeededRandom& random) {
  const float depth = 0.03F + 0.02F * static_cast<float>(random.below(3));
  return scene.plain(kBuildingLabel, {depth, 1.1F * depth, 1.25F * depth}, 0.45F);
}

void add_reveals(Scene& scene, const Opening& o, float depth, MaterialId wall) {
  scene.quad({o.x0, 0, o.z0}, {o.x0, depth, o.z0}, {o.x0, depth, o.z1}, {o.x0, 0, o.z1}, wall);
  scene.quad({o.x1, depth, o.z0}, {o.x1, 0, o.z0}, {o.x1, 0, o.z1}, {o.x1, depth, o.z1}, wall);
  scene.quad({o.x0, depth, o.z1}, {o.x1, depth, o.z1}, {o.x1, 0, o.z1}, {o.x0, 0, o.z1}, wall);
  scene.quad({o.x0, 0, o.z0}, {o.x1, 0, o.z0}, {o.x1, depth, o.z0}, {o.x0, depth, o.z0}, wall);
}

/// An upright sheet across the opening at depth y, facing the street.
void add_pane(Scene& scene, float x0, float x1, float z0, float z1, float y, MaterialId material) {
  scene.quad({x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}, material);
}

/// A bar before the glass at depth y; `sides` are those that can be seen besides its front.
void add_bar(Scene& scene, float x0, float x1, float z0, float z1, float y, MaterialId material,
             unsigned sides) {
  scene.box({x0, y - 0.045F, z0}, {x1, y, z1}, material, kSideFront | sides);
}

void add_frame(Scene& scene, const Opening& o, float y, float bar, MaterialId frame) {
  add_bar(scene, o.x0, o.x1, o.z0, o.z0 + bar, y, frame, kSideTop);
  add_bar(scene, o.x0, o.x1, o.z1 - bar, o.z1, y, frame, kSideBottom);
  add_bar(scene, o.x0, o.x0 + bar, o.z0 + bar, o.z1 - bar, y, frame, kSideRight);
  add_bar(scene, o.x1 - bar, o.x1, o.z0 + bar, o.z1 - bar, y, frame, kSideLeft);
}

/// Blinds or curtains: sheets a finger's width before the pane, which is opaque.
void add_blinds(Scene& scene, const Opening& o, float y, SeededRandom& random) {
  const float front = y - 0.012F;
  const float shade = 0.45F + 0.1F * static_cast<float>(random.below(4));
  const auto cloth =
      scene.paint(kBuildingLabel, kCurtain, {shade, 0.97F * shade, 0.9F * shade}, 0.5F);
  const int kind = random.below(6);
  if (kind == 0) {  // a roller blind
    add_pane(scene, o.x0 + kBar, o.x1 - kBar, o.z1 - random.uniform(0.25F, 0.8F) * o.height(), o.z1,
             front, cloth);
  } else if (kind <= 2) {  // a pair of curtains
    const float cover = random.uniform(0.16F, 0.3F) * o.width();
    add_pane(scene, o.x0 + kBar, o.x0 + kBar + cover, o.z0, o.z1, front, cloth);
    add_pane(scene, o.x1 - kBar - cover, o.x1 - kBar, o.z0, o.z1, front, cloth);
  }
}

void add_sill(Scene& scene, const Opening& o, const FacadeStyle& style) {
  scene.box({o.x0 - 0.07F, -0.09F, o.z0 - 0.08F}, {o.x1 + 0.07F, 0.0F, o.z0 + 0.012F}, style.trim,
            kSidesNoBack);
}

void add_surround(Scene& scene, const Opening& o, const FacadeStyle& style) {
  scene.box({o.x0 - 0.16F, -0.045F, o.z0}, {o.x0, 0.0F, o.z1}, style.trim, kSidesNoBack);
  scene.box({o.x1, -0.045F, o.z0}, {o.x1 + 0.16F, 0.0F, o.z1}, style.trim, kSidesNoBack);
  scene.box({o.x0 - 0.22F, -0.07F, o.z1}, {o.x1 + 0.22F, 0.0F, o.z1 + 0.2F}, style.trim,
            kSidesNoBack);
}

void add_shutters(Scene& scene, const Opening& o, const FacadeStyle& style) {
  const float wing = 0.48F * o.width();
  for (const float x0 : {o.x0 - wing - 0.03F, o.x1 + 0.03F}) {
    scene.box({x0, -0.05F, o.z0}, {x0 + wing, 0.0F, o.z1}, style.shutter, kSidesNoBack);
    const int slats = 8;
    for (int i = 0; i < slats; ++i) {
      const float z = o.z0 + o.height() * (static_cast<float>(i) + 0.3F) / slats;
      scene.quad({x0 + 0.06F, -0.052F, z}, {x0 + wing - 0.06F, -0.052F, z},
                 {x0 + wing - 0.06F, -0.075F, z + 0.07F}, {x0 + 0.06F, -0.075F, z + 0.07F},
                 style.shutter);
    }
  }
}

/// Display of a shop: goods on two shelves and a print, flat before the pane at y, which is opaque.
void add_display(Scene& scene, const Opening& o, float y, SeededRandom& random) {
  const float shelf = o.z0 + 0.42F * o.height();
  const auto board = scene.plain(kBuildingLabel, {0.16F, 0.13F, 0.1F});
  const bool two_shelves = random.chance(0.6);
  if (two_shelves)
    scene.box({o.x0, y - 0.045F, shelf - 0.04F}, {o.x1, y, shelf}, board, kSidesNoBack);
  const auto level = [&] { return 0.1F + 0.09F * static_cast<float>(random.below(5)); };
  for (const float bottom : {o.z0, shelf}) {
    if (bottom > o.z0 && !two_shelves) break;
    for (float x = o.x0 + 0.1F; x < o.x1 - 0.35F; x += random.uniform(0.16F, 0.5F)) {
      const float width = random.uniform(0.08F, 0.3F);
      const float height = random.uniform(0.1F, 0.36F * o.height());
      const float red = level();
      const float green = 0.5F * (red + level());  // muted colours
      const float blue = 0.5F * (green + level());
      scene.box({x, y - 0.04F, bottom}, {std::min(x + width, o.x1), y, bottom + height},
                scene.plain(kBuildingLabel, {red, green, blue}), kSidesNoBack);
    }
  }
  if (!random.chance(0.45) || o.width() < 0.9F) return;
  const float x = random.uniform(o.x0, o.x1 - 0.75F);
  const auto frame = scene.at({x, y - 0.05F, o.z0 + 0.5F});
  scene.set_uv_offset({static_cast<float>(random.below(4)), static_cast<float>(random.below(4))});
  add_pane(scene, 0.0F, 0.7F, 0.0F, 0.95F, 0.0F, scene.paint(kBuildingLabel, kPosters));
  scene.set_uv_offset(Eigen::Vector2f::Zero());
}

/// The wall from (0, z0) to (width, z1) around openings that stand in one row, left to right.
void add_pierced_wall(Scene& scene, float width_m, float z0, float z1,
                      std::span<const Opening> openings, MaterialId wall) {
  float x = 0.0F;
  for (const Opening& o : openings) {
    add_pane(scene, x, o.x0, z0, z1, 0.0F, wall);
    add_pane(scene, o.x0, o.x1, z0, o.z0, 0.0F, wall);
    add_pane(scene, o.x0, o.x1, o.z1, z1, 0.0F, wall);
    x = o.x1;
  }
  add_pane(scene, x, width_m, z0, z1, 0.0F, wall);
}

void add_window(Scene& scene, const Opening& o, const FacadeStyle& style, SeededRandom& random) {
  const float y = style.recess_m;
  add_reveals(scene, o, y, style.wall);
  add_pane(scene, o.x0, o.x1, o.z0, o.z1, y, glass(scene, random));
  add_blinds(scene, o, y, random);
  add_frame(scene, o, y, kBar, style.frame);
  const float middle = 0.5F * (o.x0 + o.x1);
  const float half = 0.5F * kBar;
  if (style.window == FacadeStyle::Window::kCasement) {
    const float transom = o.z1 - 0.28F * o.height();
    add_bar(scene, middle - half, middle + half, o.z0 + kBar, o.z1 - kBar, y, style.frame,
            kSideLeft | kSideRight);
    add_bar(scene, o.x0 + kBar, o.x1 - kBar, transom - half, transom + half, y - 0.004F,
            style.frame, kSideTop | kSideBottom);
  } else if (style.window == FacadeStyle::Window::kSash) {
    const float meeting = o.z0 + 0.5F * o.height();
    add_bar(scene, o.x0 + kBar, o.x1 - kBar, meeting - half, meeting + half, y, style.frame,
            kSideTop | kSideBottom);
    add_bar(scene, middle - 0.015F, middle + 0.015F, meeting + half, o.z1 - kBar, y, style.frame,
            kSideLeft | kSideRight);
  }
  add_sill(scene, o, style);
  if (style.surrounds) add_surround(scene, o, style);
  if (style.shutters) add_shutters(scene, o, style);
}

void add_door(Scene& scene, const Opening& o, const FacadeStyle& style, SeededRandom& random) {
  const float y = style.recess_m + 0.1F;
  add_reveals(scene, o, y, style.wall);
  const float fanlight = o.z1 - 0.5F;
  add_pane(scene, o.x0, o.x1, fanlight, o.z1, y, glass(scene, random));
  add_pane(scene, o.x0, o.x1, o.z0, fanlight, y, style.shutter);
  add_frame(scene, o, y, 0.09F, style.frame);
  add_bar(scene, o.x0, o.x1, fanlight - 0.05F, fanlight + 0.05F, y, style.frame,
          kSideTop | kSideBottom);
  const int panels = 2 + random.below(2);
  const float panel_height = (fanlight - o.z0 - 0.3F) / static_cast<float>(panels);
  for (int i = 0; i < panels; ++i) {
    const float z = o.z0 + 0.16F + static_cast<float>(i) * panel_height;
    for (const float x : {o.x0 + 0.16F, o.x0 + 0.5F * o.width() + 0.04F}) {
      scene.box({x, y - 0.03F, z + 0.05F},
                {x + 0.5F * o.width() - 0.2F, y, z + panel_height - 0.05F}, style.shutter,
                kSidesNoBack);
    }
  }
  const auto brass = scene.plain(kBuildingLabel, {0.55F, 0.45F, 0.2F}, 0.3F);
  scene.ellipsoid({o.x1 - 0.2F, y - 0.07F, o.z0 + 1.02F}, {0.035F, 0.035F, 0.035F}, 8, brass);
  scene.box({o.x0 - 0.15F, -0.45F, o.z0 - 0.16F}, {o.x1 + 0.15F, 0.02F, o.z0}, style.trim,
            kSidesNoBottom);
  if (style.surrounds) add_surround(scene, o, style);
}

void add_garage_door(Scene& scene, const Opening& o, const FacadeStyle& style,
                     SeededRandom& random) {
  const float y = style.recess_m + 0.15F;
  add_reveals(scene, o, y, style.base);
  const float shade = random.uniform(0.35F, 0.7F);
  const auto leaf = scene.paint(kBuildingLabel, kPaintedMetal, {shade, shade, 0.97F * shade}, 1.0F);
  const int slats = static_cast<int>(o.height() / 0.35F);
  const float pitch = o.height() / static_cast<float>(slats);
  for (int i = 0; i < slats; ++i) {
    const float z = o.z0 + static_cast<float>(i) * pitch;
    add_pane(scene, o.x0, o.x1, z, z + pitch - 0.03F, y - 0.025F, leaf);
    scene.quad({o.x0, y - 0.025F, z + pitch - 0.03F}, {o.x1, y - 0.025F, z + pitch - 0.03F},
               {o.x1, y, z + pitch}, {o.x0, y, z + pitch}, leaf);
  }
}

/// A shop's window over its plinth, with a door at one side if `with_door`.
void add_shop_front(Scene& scene, const Opening& o, const FacadeStyle& style, bool with_door,
                    SeededRandom& random) {
  const float y = style.recess_m + 0.05F;
  add_reveals(scene, o, y, style.base);
  const float plinth = o.z0 + 0.45F;
  const float door = with_door ? std::min(1.0F, 0.4F * o.width()) : 0.0F;
  const float x0 = o.x0 + door;
  add_pane(scene, o.x0, o.x1, o.z0, o.z1, y, glass(scene, random));
  scene.box({x0, 0.04F, o.z0}, {o.x1, y, plinth}, style.shutter, kSidesNoBack);
  add_frame(scene, {x0, o.x1, plinth, o.z1}, y, 0.07F, style.frame);
  const int panes = std::max(1, static_cast<int>((o.x1 - x0) / 1.5F));
  for (int i = 1; i < panes; ++i) {
    const float x = x0 + (o.x1 - x0) * static_cast<float>(i) / static_cast<float>(panes);
    add_bar(scene, x - 0.03F, x + 0.03F, plinth + 0.07F, o.z1 - 0.07F, y, style.frame,
            kSideLeft | kSideRight);
  }
  if (with_door) {
    add_frame(scene, {o.x0, x0, o.z0, o.z1}, y, 0.09F, style.frame);
    add_bar(scene, o.x0, x0, o.z0 + 2.15F, o.z0 + 2.23F, y, style.frame, kSideTop | kSideBottom);
  }
  add_display(scene, {x0 + 0.1F, o.x1 - 0.1F, plinth + 0.07F, o.z1 - 0.07F}, y, random);
}

/// Division of the width into bays.
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

/// Height of the top of the wall above the street [m].
float height_m(const FacadeStyle& style) {
  return floor_bottom(style, style.floors);
}

Opening centred(float middle, float width, float z0, float z1) {
  return {middle - 0.5F * width, middle + 0.5F * width, z0, z1};
}

void add_band(Scene& scene, float width_m, float z0, float z1, float out, MaterialId material) {
  scene.box({0.0F, -out, z0}, {width_m, 0.0F, z1}, material, kSidesNoBack);
}

void add_balcony(Scene& scene, float middle, float z, float width, const FacadeStyle& style) {
  const float x0 = middle - 0.5F * width;
  const float x1 = middle + 0.5F * width;
  const float depth = 0.95F;
  scene.box({x0, -depth, z - 0.18F}, {x1, 0.0F, z}, style.trim, kSidesNoBack);
  const auto iron = scene.plain(kBuildingLabel, {0.04F, 0.045F, 0.05F});
  const float top = z + 1.0F;
  const auto rail = [&](const Vector3f& low, const Vector3f& high) {
    scene.box(low, high, iron, kSidesAll);
  };
  rail({x0, -depth, top - 0.05F}, {x1, -depth + 0.05F, top});
  rail({x0, -depth + 0.05F, top - 0.05F}, {x0 + 0.05F, 0.0F, top});
  rail({x1 - 0.05F, -depth + 0.05F, top - 0.05F}, {x1, 0.0F, top});
  const int bars = static_cast<int>(width / 0.13F);
  for (int i = 0; i <= bars; ++i) {
    const float x =
        x0 + 0.015F + (width - 0.03F) * static_cast<float>(i) / static_cast<float>(bars);
    scene.box({x - 0.012F, -depth + 0.012F, z}, {x + 0.012F, -depth + 0.036F, top - 0.05F}, iron,
              kSidesAround);
  }
  for (const float x : {x0 + 0.012F, x1 - 0.036F})
    for (float y = -depth + 0.15F; y < -0.05F; y += 0.13F)
      scene.box({x, y, z}, {x + 0.024F, y + 0.024F, top - 0.05F}, iron, kSidesAround);
}

void add_awning(Scene& scene, float x0, float x1, float z, SeededRandom& random) {
  const float out = 1.1F;
  const float drop = 0.45F;
  const float hue = random.uniform(0.0F, 1.0F);
  const auto plain = scene.paint(kBuildingLabel, kCanvas, {0.75F, 0.72F, 0.65F});
  const Eigen::Vector3f tint = hue < 0.4F   ? Eigen::Vector3f(0.5F, 0.07F, 0.05F)
                               : hue < 0.7F ? Eigen::Vector3f(0.05F, 0.25F, 0.12F)
                                            : Eigen::Vector3f(0.08F, 0.15F, 0.4F);
  const auto coloured = scene.paint(kBuildingLabel, kCanvas, tint);
  const int stripes = std::max(2, static_cast<int>((x1 - x0) / 0.3F));
  for (int i = 0; i < stripes; ++i) {
    const float a = x0 + (x1 - x0) * static_cast<float>(i) / static_cast<float>(stripes);
    const float b = x0 + (x1 - x0) * static_cast<float>(i + 1) / static_cast<float>(stripes);
    const auto cloth = i % 2 == 0 ? coloured : plain;
    scene.quad({a, -out, z - drop}, {b, -out, z - drop}, {b, 0.0F, z}, {a, 0.0F, z}, cloth);
    scene.quad({b, -out, z - drop - 0.01F}, {a, -out, z - drop - 0.01F}, {a, 0.0F, z - 0.01F},
               {b, 0.0F, z - 0.01F}, cloth);
    scene.quad({a, -out, z - drop - 0.22F}, {b, -out, z - drop - 0.22F}, {b, -out, z - drop},
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
    } else if (style.ground_floor == FacadeStyle::GroundFloor::kShops) {
      openings.push_back(centred(middle, bays.width_m - 0.5F, 0.02F, top - 0.95F));
    } else if (style.ground_floor == FacadeStyle::GroundFloor::kGarages) {
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
    } else if (style.ground_floor == FacadeStyle::GroundFloor::kShops) {
      add_shop_front(scene, o, style, bay % 2 == 0, random);
      if (random.chance(0.75))
        add_sign_board(scene, o.x0, top - 0.8F, o.width(), 0.55F, kBuildingLabel, random);
      if (random.chance(0.4)) add_awning(scene, o.x0, o.x1, top - 0.85F, random);
    } else if (style.ground_floor == FacadeStyle::GroundFloor::kGarages) {
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
    if (has_balcony(bay))
      add_balcony(scene, bays.middle(bay), bottom, std::min(bays.width_m - 0.2F, 2.6F), style);
  }
}

void add_cornice(Scene& scene, const FacadeStyle& style, float width_m) {
  const float top = height_m(style);
  add_band(scene, width_m, top - 0.55F, top - 0.4F, 0.1F, style.trim);
  add_band(scene, width_m, top - 0.25F, top + 0.05F, 0.35F, style.trim);
  const int corbels = std::max(2, static_cast<int>(width_m / 0.7F));
  for (int i = 0; i < corbels; ++i) {
    const float x = width_m * (static_cast<float>(i) + 0.5F) / static_cast<float>(corbels);
    scene.box({x - 0.08F, -0.3F, top - 0.4F}, {x + 0.08F, 0.0F, top - 0.25F}, style.trim,
              kSidesNoBack);
  }
}

void add_downpipe(Scene& scene, const FacadeStyle& style) {
  const auto zinc = scene.plain(kBuildingLabel, {0.3F, 0.32F, 0.33F}, 0.05F);
  const float top = height_m(style) - 0.3F;
  scene.cylinder({0.22F, -0.1F, -0.2F}, {0.22F, -0.1F, top}, 0.055F, 0.055F, 8, zinc, false);
  for (float z = 1.0F; z < top; z += 2.0F)
    scene.box({0.145F, -0.165F, z}, {0.295F, 0.0F, z + 0.05F}, zinc, kSidesNoBack);
}

/// A facade from x = 0 to `width_m`, its wall in the plane y = 0.
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

/// The rear of a house: a wall with a few small windows, or none if `blind`.
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
    for (int bay = 0; bay < bays.count && !blind; ++bay)
      openings.push_back(centred(bays.middle(bay), 0.9F, bottom + 1.1F, bottom + 2.3F));
    add_pierced_wall(scene, width_m, floor == 0 ? -0.6F : bottom, top, openings, style.wall);
    for (const Opening& o : openings) add_window(scene, o, plain, random);
  }
}

void add_parapet(Scene& scene, const Building& b, float z) {
  const float top = z + 0.55F;
  const float thick = 0.25F;
  const auto run = [&](const Vector3f& low, const Vector3f& high) {
    scene.box(low, {high.x(), high.y(), top}, b.style.wall, kSidesAround);
    scene.box({low.x() - 0.04F, low.y() - 0.04F, top},
              {high.x() + 0.04F, high.y() + 0.04F, top + 0.08F}, b.style.trim, kSidesAll);
  };
  run({0, 0, z}, {b.width_m, thick, top});
  run({0, b.depth_m - thick, z}, {b.width_m, b.depth_m, top});
  run({0, thick, z}, {thick, b.depth_m - thick, top});
  run({b.width_m - thick, thick, z}, {b.width_m, b.depth_m - thick, top});
}

void add_flat_roof(Scene& scene, const Building& b, SeededRandom& random) {
  const float z = height_m(b.style);
  scene.quad({0, 0, z}, {b.width_m, 0, z}, {b.width_m, b.depth_m, z}, {0, b.depth_m, z}, b.roofing);
  add_parapet(scene, b, z);
  const auto metal = scene.paint(kBuildingLabel, kPaintedMetal, {0.5F, 0.5F, 0.5F});
  const int machines = 1 + random.below(3);
  for (int i = 0; i < machines; ++i) {
    const float x = random.uniform(1.0F, std::max(1.1F, b.width_m - 3.0F));
    const float y = random.uniform(1.5F, std::max(1.6F, b.depth_m - 3.0F));
    const Vector3f size(random.uniform(1.0F, 2.5F), random.uniform(1.0F, 2.0F),
                        random.uniform(0.8F, 2.2F));
    scene.box({x, y, z},
              {std::min(x + size.x(), b.width_m - 0.5F), std::min(y + size.y(), b.depth_m - 0.5F),
               z + size.z()},
              metal, kSidesNoBottom);
  }
}

void add_chimney(Scene& scene, const Building& b, float x, float ridge) {
  const auto brick = scene.paint(kBuildingLabel, kBrick);
  const auto pot = scene.plain(kBuildingLabel, {0.4F, 0.18F, 0.1F});
  const float y = 0.5F * b.depth_m + 0.4F;
  scene.box({x, y, ridge - 1.5F}, {x + 0.9F, y + 0.6F, ridge + 0.9F}, brick, kSidesNoBottom);
  for (const float dx : {0.25F, 0.65F}) {
    scene.cylinder({x + dx, y + 0.3F, ridge + 0.9F}, {x + dx, y + 0.3F, ridge + 1.25F}, 0.12F, 0.1F,
                   8, pot);
  }
}

void add_dormer(Scene& scene, const Building& b, float x, float z, float slope) {
  const float y = 0.9F;  // behind the wall
  const float base = z + y * slope;
  const float half = 0.75F;
  const float top = base + 1.5F;
  const float back = y + 1.5F / slope;
  const auto& style = b.style;
  const auto glass = scene.plain(kBuildingLabel, {0.05F, 0.055F, 0.06F}, 0.45F);
  scene.quad({x - half, y, base}, {x + half, y, base}, {x + half, y, top}, {x - half, y, top},
             style.trim);
  scene.quad({x - 0.5F, y - 0.01F, base + 0.25F}, {x + 0.5F, y - 0.01F, base + 0.25F},
             {x + 0.5F, y - 0.01F, top - 0.2F}, {x - 0.5F, y - 0.01F, top - 0.2F}, glass);
  scene.box({x - 0.03F, y - 0.04F, base + 0.25F}, {x + 0.03F, y - 0.01F, top - 0.2F}, style.frame,
            kSidesNoBack);
  scene.triangle({x - half, back, top}, {x - half, y, base}, {x - half, y, top}, style.wall);
  scene.triangle({x - half, back, top}, {x - half, y, top}, {x - half, y, base}, style.wall);
  scene.triangle({x + half, y, base}, {x + half, back, top}, {x + half, y, top}, style.wall);
  scene.box({x - half - 0.15F, y - 0.25F, top}, {x + half + 0.15F, back, top + 0.12F}, b.roofing);
}

void add_ridge_roof(Scene& scene, const Building& b, SeededRandom& random) {
  const float z = height_m(b.style);
  const float slope = std::tan(random.uniform(0.6F, 0.85F));
  const float eave = 0.4F;
  const float middle = 0.5F * b.depth_m;
  const float ridge = z + slope * middle;
  const float low = z - slope * eave;
  const float w = b.width_m;
  const float d = b.depth_m;
  scene.quad({0, -eave, low}, {w, -eave, low}, {w, middle, ridge}, {0, middle, ridge}, b.roofing);
  scene.quad({w, d + eave, low}, {0, d + eave, low}, {0, middle, ridge}, {w, middle, ridge},
             b.roofing);
  scene.quad({w, -eave, low - 0.02F}, {0, -eave, low - 0.02F}, {0, 0, z - 0.02F}, {w, 0, z - 0.02F},
             b.style.trim);  // soffit
  scene.triangle({0, d, z}, {0, 0, z}, {0, middle, ridge}, b.style.wall);
  scene.triangle({w, 0, z}, {w, d, z}, {w, middle, ridge}, b.style.wall);
  const auto zinc = scene.plain(kBuildingLabel, {0.3F, 0.32F, 0.33F}, 0.05F);
  scene.cylinder({0, -eave - 0.06F, low}, {w, -eave - 0.06F, low}, 0.08F, 0.08F, 8, zinc);
  add_chimney(scene, b, random.uniform(0.1F, 0.8F) * w, ridge);
  if (random.chance(0.6)) {
    const int dormers = std::max(1, static_cast<int>(w / 3.6F));
    for (int i = 0; i < dormers; ++i) {
      add_dormer(scene, b, w * (static_cast<float>(i) + 0.5F) / static_cast<float>(dormers), z,
                 slope);
    }
  }
}

void add_wall(Scene& scene, const Building& b, WallKind kind, float width_m) {
  if (kind == WallKind::kRich) add_facade(scene, b.style, width_m);
  if (kind == WallKind::kPlain) add_plain_facade(scene, b.style, width_m, false);
  if (kind == WallKind::kBlind) add_plain_facade(scene, b.style, width_m, true);
}

void choose_walls(Scene& scene, FacadeStyle& style, SeededRandom& random) {
  const int kind = random.below(10);
  const float light = 0.1F * static_cast<float>(random.below(3));
  if (kind <= 2) {
    const float red = 0.8F + light;
    style.wall = scene.paint(kBuildingLabel, kBrick, {red, 0.9F * red, 0.85F * red});
    style.base = random.chance(0.4) ? scene.paint(kBuildingLabel, kStoneBlocks) : style.wall;
  } else if (kind <= 7) {
    const Vector3f tints[] = {{0.72F, 0.6F, 0.36F}, {0.7F, 0.68F, 0.62F}, {0.62F, 0.38F, 0.28F},
                              {0.45F, 0.5F, 0.42F}, {0.42F, 0.5F, 0.58F}, {0.74F, 0.66F, 0.55F},
                              {0.52F, 0.5F, 0.48F}, {0.68F, 0.5F, 0.42F}};
    style.wall = scene.paint(kBuildingLabel, kPlaster, random.pick(tints));
    style.base = random.chance(0.5) ? scene.paint(kBuildingLabel, kPlaster,
                                                  {0.4F + light, 0.38F + light, 0.36F + light})
                                    : style.wall;
  } else if (kind == 8) {
    style.wall = scene.paint(kBuildingLabel, kStoneBlocks, {0.9F, 0.88F, 0.82F});
    style.base = style.wall;
  } else {
    style.wall = scene.paint(kBuildingLabel, kConcrete, {1.0F, 1.0F, 0.97F});
    style.base = style.wall;
  }
}

}  // namespace

void add_building(Scene& scene, const Building& b) {
  const float w = b.width_m;
  const float d = b.depth_m;
  const Vector3f corners[] = {{0.0F, 0.0F, 0.0F}, {w, 0.0F, 0.0F}, {w, d, 0.0F}, {0.0F, d, 0.0F}};
  SeededRandom random = SeededRandom::stream(b.style.seed, 3);
  scene.set_uv_offset({random.uniform(0.0F, 7.0F), random.uniform(0.0F, 7.0F)});
  for (int side = 0; side < 4; ++side) {
    const auto i = static_cast<std::size_t>(side);
    const float yaw = 0.5F * std::numbers::pi_v<float> * static_cast<float>(side);
    scene.at(corners[i], yaw).add(add_wall, b, b.walls[i], side % 2 == 0 ? w : d);
  }
  if (b.ridge)
    add_ridge_roof(scene, b, random);
  else
    add_flat_roof(scene, b, random);
  scene.set_uv_offset(Vector2f::Zero());
}

Building random_building(Scene& scene, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 4);
  Building b;
  FacadeStyle& style = b.style;
  style.seed = seed;
  choose_walls(scene, style, random);
  const float stone = random.uniform(0.0F, 1.0F) < 0.6F ? 0.9F : 0.6F;
  style.trim = scene.paint(kBuildingLabel, kConcrete, {stone, 0.98F * stone, 0.93F * stone});
  style.frame = random.chance(0.7) ? scene.plain(kBuildingLabel, {0.75F, 0.75F, 0.72F})
                                   : scene.plain(kBuildingLabel, {0.16F, 0.1F, 0.06F});
  const Vector3f doors[] = {{0.1F, 0.2F, 0.12F},
                            {0.25F, 0.06F, 0.05F},
                            {0.08F, 0.12F, 0.25F},
                            {0.28F, 0.17F, 0.09F},
                            {0.2F, 0.22F, 0.24F}};
  style.shutter = scene.paint(kBuildingLabel, kPaintedMetal, random.pick(doors));
  style.floors = 3 + random.below(3);
  style.ground_floor_m = random.uniform(3.5F, 4.2F);
  style.floor_m = random.uniform(2.9F, 3.3F);
  style.bay_m = random.uniform(2.1F, 3.1F);
  style.window_width_m = random.uniform(0.95F, 1.3F);
  style.window_height_m = random.uniform(1.45F, 1.8F);
  style.recess_m = random.uniform(0.1F, 0.24F);
  style.window = random.chance(0.55)  ? FacadeStyle::Window::kCasement
                 : random.chance(0.5) ? FacadeStyle::Window::kSash
                                      : FacadeStyle::Window::kPane;
  style.ground_floor = random.chance(0.45)   ? FacadeStyle::GroundFloor::kShops
                       : random.chance(0.15) ? FacadeStyle::GroundFloor::kGarages
                                             : FacadeStyle::GroundFloor::kWindows;
  style.surrounds = random.chance(0.4);
  style.shutters = !style.surrounds && style.bay_m > 2.5F && random.chance(0.45);
  style.balconies = random.chance(0.3);
  style.string_courses = random.chance(0.6);
  style.cornice = random.chance(0.7);
  style.downpipe = random.chance(0.8);
  b.ridge = random.chance(0.55);
  b.roofing = b.ridge ? scene.paint(kBuildingLabel, kRoofTiles, {0.8F + 0.2F * stone, 0.9F, 0.9F})
                      : scene.paint(kBuildingLabel, kGravel, {0.8F, 0.8F, 0.8F});
  return b;
}

}  // namespace km
