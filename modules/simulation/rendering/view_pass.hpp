#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/simulation/rendering/pixel_rays.hpp"
#include "modules/simulation/rendering/renderer.hpp"
#include "modules/simulation/rendering/surface_shader.hpp"

namespace km {

/// One call of Renderer::render(): a ray and a shade per pixel, then more rays where the picture
/// has edges.
class ViewPass {
 public:
  ViewPass(const RenderScene& scene, const RenderOptions& options, const PixelRays& rays,
           const SE3& T_world_body, const RenderRequest& request);

  [[nodiscard]] RenderedView run();

 private:
  /// What the second half needs to know of a pixel's centre.
  struct Pixel {
    std::uint32_t triangle = kNoTriangle;
    float depth_m = 0.0F;
    std::uint16_t material = kSkyMaterial;
    bool foliage = false;
    bool dark = false;  ///< The sun is hidden.
  };
  static constexpr std::uint16_t kSkyMaterial = 0xFFFF;
  /// Pixel of each lane, and where in the pixel its ray goes, from the centre [px].
  struct Aim {
    std::array<int, kLanes> x{}, y{};
    Lanes dx, dy;
  };

  enum Edge : std::uint8_t { kNoEdge = 0, kShapeEdge = 1, kShadowEdge = 2, kLeafEdge = 4 };

  void shade_block(int x0, int y0);
  void store_block(const Aim& aim, const SurfaceHits& hits, const SurfacePoints& points,
                   LaneMask dark);
  void compare_neighbours();
  void compare(std::size_t a, std::size_t b);
  [[nodiscard]] bool contrast(std::size_t a, std::size_t b) const;
  void find_thin_things(int x0, int y0);
  void flag_unlike(int x, int y, std::uint32_t triangle, const Eigen::Vector3f& hit);
  [[nodiscard]] Edge edge_towards(std::size_t pixel, std::uint32_t triangle) const;
  /// Whether a point of another triangle looks like the same surface as the pixel's centre.
  [[nodiscard]] bool same_surface(std::size_t pixel, std::uint32_t triangle,
                                  const Eigen::Vector3f& point) const;
  [[nodiscard]] Eigen::Vector3f position(std::size_t pixel) const;
  void refine_edges();
  void refine(std::span<const std::size_t> pixels, int samples_per_pixel);
  /// Where the shades of samples come from.
  struct Samples {
    int per_pixel = 1;
    std::array<std::size_t, kLanes> source{};  ///< The pixel whose shade a sample takes,
    LaneMask fresh = 0;                        ///< unless it must be shaded itself.
    LaneMask dark = 0;                         ///< The sun does not reach it.
    LaneMask ask_sun = 0;                      ///< That is to be found out.
  };
  void find_sources(std::span<const std::size_t> pixels, const Aim& aim, const SurfaceHits& hits,
                    Samples& samples) const;
  template <typename Value>
  void average(std::span<const std::size_t> pixels, const SurfaceHits& hits,
               const SurfacePoints& points, const Samples& samples,
               const std::vector<Shade<Value>>& shaded, std::vector<Value>& image) const;
  [[nodiscard]] std::optional<std::size_t> shaded_nearby(std::size_t pixel, std::uint32_t triangle,
                                                         float depth_m,
                                                         const Eigen::Vector2f& offset) const;
  [[nodiscard]] bool alike(const Pixel& pixel, const SurfaceRecord& surface, float depth_m) const;

  [[nodiscard]] static Aim aim_at_block(int x0, int y0);
  /// Lanes of a 4 x 4 block that lie in the image.
  [[nodiscard]] LaneMask lanes_inside(const Aim& aim) const;
  void trace(const Aim& aim, LaneMask active, SurfaceHits& hits) const;
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  const RenderScene& scene_;
  const RenderOptions& options_;
  const PixelRays& rays_;
  const RenderRequest& request_;
  int width_;
  int height_;
  Eigen::Matrix3f R_world_cam_;
  Eigen::Vector3f origin_;
  int samples_;  ///< Per pixel with an edge.

  RenderedView view_;
  std::vector<Pixel> pixels_;
  std::vector<std::uint8_t> edge_;  ///< Of Edge.
  std::vector<Shade<float>> gray_;
  std::vector<Shade<Eigen::Vector3f>> color_;
};

}  // namespace km
