#include "modules/simulation/world/openings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace km {
namespace {

using Eigen::Vector3f;

constexpr float kBar = 0.055F;  // width of a window's bars [m]

MaterialId glass(Scene& scene, SeededRandom& random) {
  const float depth = 0.03F + 0.02F * static_cast<float>(random.below(3));
  return scene.plain(SurfaceClass::kBuilding, depth, 1.1F * depth, 1.25F * depth, 0.45F);
}

void add_reveals(Scene& scene, const Opening& o, float depth, MaterialId wall) {
  MeshBuilder& mesh = scene.mesh;
  mesh.quad({o.x0, 0, o.z0}, {o.x0, depth, o.z0}, {o.x0, depth, o.z1}, {o.x0, 0, o.z1}, wall);
  mesh.quad({o.x1, depth, o.z0}, {o.x1, 0, o.z0}, {o.x1, 0, o.z1}, {o.x1, depth, o.z1}, wall);
  mesh.quad({o.x0, depth, o.z1}, {o.x1, depth, o.z1}, {o.x1, 0, o.z1}, {o.x0, 0, o.z1}, wall);
  mesh.quad({o.x0, 0, o.z0}, {o.x1, 0, o.z0}, {o.x1, depth, o.z0}, {o.x0, depth, o.z0}, wall);
}

/// An upright sheet across the opening at depth y, facing the street.
void add_pane(Scene& scene, float x0, float x1, float z0, float z1, float y, MaterialId material) {
  scene.mesh.quad({x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}, material);
}

/// A bar before the glass at depth y; `sides` are those that can be seen besides its front.
void add_bar(Scene& scene, float x0, float x1, float z0, float z1, float y, MaterialId material,
             unsigned sides) {
  scene.mesh.box({x0, y - 0.045F, z0}, {x1, y, z1}, material, kSideFront | sides);
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
  const MaterialId cloth = scene.paint(SurfaceClass::kBuilding, Recipe::kCurtain,
                                       {shade, 0.97F * shade, 0.9F * shade}, 0.5F);
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
  scene.mesh.box({o.x0 - 0.07F, -0.09F, o.z0 - 0.08F}, {o.x1 + 0.07F, 0.0F, o.z0 + 0.012F},
                 style.trim, kSidesNoBack);
}

void add_surround(Scene& scene, const Opening& o, const FacadeStyle& style) {
  MeshBuilder& mesh = scene.mesh;
  mesh.box({o.x0 - 0.16F, -0.045F, o.z0}, {o.x0, 0.0F, o.z1}, style.trim, kSidesNoBack);
  mesh.box({o.x1, -0.045F, o.z0}, {o.x1 + 0.16F, 0.0F, o.z1}, style.trim, kSidesNoBack);
  mesh.box({o.x0 - 0.22F, -0.07F, o.z1}, {o.x1 + 0.22F, 0.0F, o.z1 + 0.2F}, style.trim,
           kSidesNoBack);
}

void add_shutters(Scene& scene, const Opening& o, const FacadeStyle& style) {
  const float wing = 0.48F * o.width();
  for (const float x0 : {o.x0 - wing - 0.03F, o.x1 + 0.03F}) {
    scene.mesh.box({x0, -0.05F, o.z0}, {x0 + wing, 0.0F, o.z1}, style.shutter, kSidesNoBack);
    const int slats = 8;
    for (int i = 0; i < slats; ++i) {
      const float z = o.z0 + o.height() * (static_cast<float>(i) + 0.3F) / slats;
      scene.mesh.quad({x0 + 0.06F, -0.052F, z}, {x0 + wing - 0.06F, -0.052F, z},
                      {x0 + wing - 0.06F, -0.075F, z + 0.07F}, {x0 + 0.06F, -0.075F, z + 0.07F},
                      style.shutter);
    }
  }
}

/// What a shop shows: goods on two shelves and a print, flat before the pane at y, which is opaque.
void add_display(Scene& scene, const Opening& o, float y, SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  const float shelf = o.z0 + 0.42F * o.height();
  const MaterialId board = scene.plain(SurfaceClass::kBuilding, 0.16F, 0.13F, 0.1F);
  const bool two_shelves = random.chance(0.6);
  if (two_shelves)
    mesh.box({o.x0, y - 0.045F, shelf - 0.04F}, {o.x1, y, shelf}, board, kSidesNoBack);
  const auto level = [&] { return 0.1F + 0.09F * static_cast<float>(random.below(5)); };
  for (const float bottom : {o.z0, shelf}) {
    if (bottom > o.z0 && !two_shelves) break;
    for (float x = o.x0 + 0.1F; x < o.x1 - 0.35F; x += random.uniform(0.16F, 0.5F)) {
      const float width = random.uniform(0.08F, 0.3F);
      const float height = random.uniform(0.1F, 0.36F * o.height());
      const float red = level();
      const float green = 0.5F * (red + level());  // muted colours
      const float blue = 0.5F * (green + level());
      mesh.box({x, y - 0.04F, bottom}, {std::min(x + width, o.x1), y, bottom + height},
               scene.plain(SurfaceClass::kBuilding, red, green, blue), kSidesNoBack);
    }
  }
  if (!random.chance(0.45) || o.width() < 0.9F) return;
  const float x = random.uniform(o.x0, o.x1 - 0.75F);
  const ScopedFrame frame(mesh, standing_at({x, y - 0.05F, o.z0 + 0.5F}, 0.0F));
  mesh.set_uv_offset({static_cast<float>(random.below(4)), static_cast<float>(random.below(4))});
  add_pane(scene, 0.0F, 0.7F, 0.0F, 0.95F, 0.0F,
           scene.paint(SurfaceClass::kBuilding, Recipe::kPosters));
  mesh.set_uv_offset(Eigen::Vector2f::Zero());
}

}  // namespace

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
  if (style.window == WindowKind::kCasement) {
    const float transom = o.z1 - 0.28F * o.height();
    add_bar(scene, middle - half, middle + half, o.z0 + kBar, o.z1 - kBar, y, style.frame,
            kSideLeft | kSideRight);
    add_bar(scene, o.x0 + kBar, o.x1 - kBar, transom - half, transom + half, y - 0.004F,
            style.frame, kSideTop | kSideBottom);
  } else if (style.window == WindowKind::kSash) {
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
  MeshBuilder& mesh = scene.mesh;
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
      mesh.box({x, y - 0.03F, z + 0.05F},
               {x + 0.5F * o.width() - 0.2F, y, z + panel_height - 0.05F}, style.shutter,
               kSidesNoBack);
    }
  }
  const MaterialId brass = scene.plain(SurfaceClass::kBuilding, 0.55F, 0.45F, 0.2F, 0.3F);
  mesh.ellipsoid({o.x1 - 0.2F, y - 0.07F, o.z0 + 1.02F}, {0.035F, 0.035F, 0.035F}, 8, brass);
  mesh.box({o.x0 - 0.15F, -0.45F, o.z0 - 0.16F}, {o.x1 + 0.15F, 0.02F, o.z0}, style.trim,
           kSidesNoBottom);
  if (style.surrounds) add_surround(scene, o, style);
}

void add_garage_door(Scene& scene, const Opening& o, const FacadeStyle& style,
                     SeededRandom& random) {
  const float y = style.recess_m + 0.15F;
  add_reveals(scene, o, y, style.base);
  const float shade = random.uniform(0.35F, 0.7F);
  const MaterialId leaf = scene.paint(SurfaceClass::kBuilding, Recipe::kPaintedMetal,
                                      {shade, shade, 0.97F * shade}, 1.0F);
  const int slats = static_cast<int>(o.height() / 0.35F);
  const float pitch = o.height() / static_cast<float>(slats);
  for (int i = 0; i < slats; ++i) {
    const float z = o.z0 + static_cast<float>(i) * pitch;
    add_pane(scene, o.x0, o.x1, z, z + pitch - 0.03F, y - 0.025F, leaf);
    scene.mesh.quad({o.x0, y - 0.025F, z + pitch - 0.03F}, {o.x1, y - 0.025F, z + pitch - 0.03F},
                    {o.x1, y, z + pitch}, {o.x0, y, z + pitch}, leaf);
  }
}

void add_shop_front(Scene& scene, const Opening& o, const FacadeStyle& style, bool with_door,
                    SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  const float y = style.recess_m + 0.05F;
  add_reveals(scene, o, y, style.base);
  const float plinth = o.z0 + 0.45F;
  const float door = with_door ? std::min(1.0F, 0.4F * o.width()) : 0.0F;
  const float x0 = o.x0 + door;
  add_pane(scene, o.x0, o.x1, o.z0, o.z1, y, glass(scene, random));
  mesh.box({x0, 0.04F, o.z0}, {o.x1, y, plinth}, style.shutter, kSidesNoBack);
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

void add_sign_board(Scene& scene, float x, float z, float width_m, float height_m,
                    SurfaceClass label, SeededRandom& random) {
  static constexpr std::array<std::array<float, 3>, 7> kBoards = {{{0.55F, 0.08F, 0.06F},
                                                                   {0.05F, 0.13F, 0.4F},
                                                                   {0.04F, 0.25F, 0.12F},
                                                                   {0.75F, 0.72F, 0.66F},
                                                                   {0.08F, 0.08F, 0.09F},
                                                                   {0.7F, 0.45F, 0.06F},
                                                                   {0.3F, 0.08F, 0.25F}}};
  const std::size_t kind = static_cast<std::size_t>(random.below(kBoards.size()));
  const auto& [red, green, blue] = kBoards[kind];
  const MaterialId board = scene.plain(label, red, green, blue);
  const bool dark_letters = red + green + blue > 1.2F;
  const float ink = dark_letters ? 0.05F : 0.85F;
  const MaterialId letters = scene.plain(label, ink, ink, 0.95F * ink);
  MeshBuilder& mesh = scene.mesh;
  mesh.box({x, -0.1F, z}, {x + width_m, 0.0F, z + height_m}, board, kSidesNoBack);
  const float letter = 0.6F * height_m;
  const float bottom = z + 0.2F * height_m;
  const float stroke = 0.16F * letter;
  for (float left = x + 0.4F * letter; left + letter < x + width_m; left += 0.95F * letter) {
    if (random.chance(0.14)) continue;  // a space
    const float right = left + 0.62F * letter;
    const auto bar = [&](float x0, float z0, float x1, float z1) {
      if (random.chance(0.55)) {
        mesh.box({x0, -0.125F, z0}, {x1, -0.1F, z1}, letters, kSidesNoBack);
      }
    };
    const float top = bottom + letter;
    const float middle = bottom + 0.5F * letter;
    bar(left, bottom, left + stroke, top);
    bar(right - stroke, bottom, right, top);
    bar(left, top - stroke, right, top);
    bar(left, middle - 0.5F * stroke, right, middle + 0.5F * stroke);
    bar(left, bottom, right, bottom + stroke);
  }
}

}  // namespace km
