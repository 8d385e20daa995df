#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "apps/lab/simulation/rendering/shot.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/camera/camera.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Viewing rays of every pixel of a camera, without distortion. They are computed once per camera
/// (some 20 ms at 752x480), and shared by all its views. Immutable.
class PixelRays {
 public:
  explicit PixelRays(const Camera& camera);

  [[nodiscard]] const Camera& camera() const { return camera_; }

  /// Bearings of the pixels' centres on the plane z = 1 of the camera frame, row-major. There is
  /// one column and one row more than in the image, so that differences give each pixel's extent. 0
  /// where the lens has no bearing.
  [[nodiscard]] const std::vector<Eigen::Vector2f>& bearings() const { return bearings_; }
  [[nodiscard]] int stride() const { return camera_.width + 1; }

  /// False for a pixel (index in width * height, row-major) for which the lens has no bearing, or
  /// none for the pixel to its right or below. Such a pixel is black.
  [[nodiscard]] bool is_lit(std::size_t pixel) const { return lit_[pixel] != 0; }

 private:
  Camera camera_;
  std::vector<Eigen::Vector2f> bearings_;
  std::vector<std::uint8_t> lit_;
};

/// The camera with its image shrunk by `factor` (at least 1): the same field of view, fewer pixels.
/// For metering, previews and tests. Sizes round up.
[[nodiscard]] Camera shrunk(const Camera& camera, int factor);

/// Light on the sensor, before exposure, noise and quantisation; row-major, width * height each.
/// Vectors that were not requested are empty.
struct RenderedView {
  int width = 0;
  int height = 0;
  std::vector<float> radiance;  ///< Linear grey, anti-aliased; a white wall in the sun is 1.
  std::vector<float> depth_m;   ///< z in the camera frame at the pixel's centre [m]; 0: sky.
  /// Labels at the centres of the pixels. Sky is SurfaceClass::kSky; pixels without a bearing are
  /// SurfaceClass::kUnknown.
  std::vector<LabelId> labels;
};

struct RenderRequest {
  bool radiance = true;
  bool depth = false;
  bool labels = false;
};

class MovedSurfaces;
struct RenderScene;

/// Ray caster over one world. Immutable after construction. render() may be called from several
/// threads at once and gives the same bytes whatever their number.
class Renderer {
 public:
  /// Builds the acceleration structure and bakes ambient light. `world` must outlive the renderer.
  explicit Renderer(const World& world);
  ~Renderer();

  /// One view through a camera (distortion included), its body at T_world_body.
  [[nodiscard]] RenderedView render(const PixelRays& rays, const SE3& T_world_body,
                                    const RenderRequest& request) const;
  /// One view whose row y is seen from T_world_body[y], as by a rolling shutter, with the surfaces
  /// `moved` in addition to the world's. One pose holds for all rows.
  [[nodiscard]] RenderedView render(const PixelRays& rays, std::span<const SE3> T_world_body,
                                    const RenderRequest& request,
                                    const MovedSurfaces* moved = nullptr) const;

  /// The sun and the lamps that shine on the body at T_world_body without a surface between.
  [[nodiscard]] std::vector<LightSource> visible_lights(const SE3& T_world_body) const;

 private:
  std::unique_ptr<const RenderScene> scene_;
};

}  // namespace km
