#include "modules/simulation/rendering/renderer.hpp"

#include "modules/simulation/rendering/surface_shader.hpp"
#include "modules/simulation/rendering/view_pass.hpp"

namespace km {

struct Renderer::Impl {
  RenderScene scene;
  RenderOptions options;
};

Renderer::Renderer(const World& world, const RenderOptions& options)
    : impl_(new Impl{RenderScene(world), options}) {}

Renderer::~Renderer() = default;

RenderedView Renderer::render(const PixelRays& rays, const SE3& T_world_body,
                              const RenderRequest& request) const {
  return ViewPass(impl_->scene, impl_->options, rays, T_world_body, request).run();
}

RenderedView Renderer::render(const PinholeCamera& camera, const SE3& T_world_body,
                              const RenderRequest& request) const {
  return render(PixelRays(camera), T_world_body, request);
}

}  // namespace km
