#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "apps/lab/simulation/rendering/renderer.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/camera/camera.hpp"

namespace km::small_world {

/// A world of uniform materials, lit evenly by an ambient light of 1 unless changed. The room it
/// describes is closed only if the test builds it so.
class Builder {
 public:
  Builder() {
    world_.name = "test";
    world_.textures.push_back(uniform_texture(1.0F));
    world_.textures.push_back(uniform_texture(0.5F));  // a detail that changes nothing
    world_.lighting.sun = 0.0F;
    world_.lighting.ambient = 1.0F;
  }

  static Texture uniform_texture(float albedo) { return {1, {Eigen::Vector3f::Constant(albedo)}}; }

  MaterialId material(SurfaceClass label, float albedo, std::uint16_t base = 0) {
    Material material{.label = label,
                      .tint = Eigen::Vector3f::Constant(albedo),
                      .base = base,
                      .detail = 1,
                      .base_period_m = 1.0F};
    world_.materials.push_back(material);
    return static_cast<MaterialId>(world_.materials.size() - 1);
  }

  /// A square facing -x (towards a camera at the origin that looks along +x) at distance x.
  void wall(float x, float half_size, MaterialId id) {
    scene.quad({x, half_size, -half_size}, {x, -half_size, -half_size}, {x, -half_size, half_size},
               {x, half_size, half_size}, id);
  }

  World build() {
    world_.mesh = scene.mesh();
    return std::move(world_);
  }

  Scene scene;
  World& world() { return world_; }

 private:
  World world_;
};

/// One view of a world.
inline RenderedView view_of(const World& world, const Camera& camera, const SE3& T_world_body,
                            const RenderRequest& request = {}) {
  return Renderer(world).render(PixelRays(camera), T_world_body, request);
}

/// Radiance of a pixel.
inline float at(const RenderedView& view, int x, int y) {
  return view.radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
                       static_cast<std::size_t>(x)];
}

/// Camera that looks along the body's +x with its image upright (body: x forward, z up).
inline Camera forward_camera(int width, int height, double focal_px) {
  Camera camera{.width = width,
                .height = height,
                .fx = focal_px,
                .fy = focal_px,
                .cx = 0.5 * (width - 1),
                .cy = 0.5 * (height - 1)};
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_body_cam.linear() = R_body_cam;
  return camera;
}

/// EuRoC's left lens on that camera.
inline Camera distorted_camera(int width, int height, double focal_px) {
  Camera camera = forward_camera(width, height, focal_px);
  camera.lens =
      Lens(LensModel::kRadialTangential, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  return camera;
}

}  // namespace km::small_world
