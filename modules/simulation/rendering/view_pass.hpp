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
    LaneMask active = 0;
    std::array<int, kLanes> x{}, y{};
    std::array<float, kLanes> dx{}, dy{};

    void set(std::size_t lane, int px, int py, const Eigen::Vector2f& offset) {
      active |= 1U << lane;
      x[lane] = px;
      y[lane] = py;
      dx[lane] = offset.x();
      dy[lane] = offset.y();
    }
  };

  /// Where in a pixel there is an edge: on the way to a neighbour, or anywhere; and whether it may
  /// be one of a shadow.
  enum Edge : std::uint8_t {
    kNoEdge = 0,
    kLeft = 1,
    kRight = 2,
    kUp = 4,
    kDown = 8,
    kInside = 16,
    kShadow = 32,
  };

  void shade_block(int x0, int y0);
  void store_block(const Aim& aim, const SurfaceHits& hits, const SurfacePoints& points,
                   LaneMask dark);
  void compare_neighbours();
  void compare(std::size_t a, Edge towards_b, std::size_t b, Edge towards_a);
  [[nodiscard]] bool contrast(std::size_t a, std::size_t b) const;
  void find_thin_things(int x0, int y0);
  void flag_unlike(int x, int y, std::uint32_t triangle, const Eigen::Vector3f& hit);
  /// Whether a point of another triangle looks like the same surface as the pixel's centre.
  [[nodiscard]] bool same_surface(std::size_t pixel, std::uint32_t triangle,
                                  const Eigen::Vector3f& point) const;
  [[nodiscard]] Eigen::Vector3f position(std::size_t pixel) const;

  struct Sample {
    int x = 0, y = 0;
    Eigen::Vector2f offset = Eigen::Vector2f::Zero();  ///< From the pixel's centre [px].
  };
  /// Samples whose light must be found out: they wait until there are enough for a packet.
  struct Deferred {
    SurfaceHits hits{};
    std::size_t count = 0;
    std::array<std::size_t, kLanes> pixel{};   ///< That the sample belongs to.
    std::array<std::size_t, kLanes> source{};  ///< Pixel whose shade it takes,
    LaneMask fresh = 0;                        ///< unless it must be shaded itself.
  };
  [[nodiscard]] static bool beyond_edge(std::uint8_t edge, const Eigen::Vector2f& offset);
  void refine_edges();
  void refine(std::span<const Sample> batch);
  [[nodiscard]] std::optional<std::size_t> shaded_nearby(const Sample& sample,
                                                         std::uint32_t triangle,
                                                         float depth_m) const;
  [[nodiscard]] bool alike(const Pixel& pixel, const SurfaceRecord& surface, float depth_m) const;
  void defer(const SurfaceHits& hits, std::size_t lane, std::size_t pixel,
             std::optional<std::size_t> source);
  void light_deferred();
  template <typename Value>
  void mix(const SurfacePoints& points, LaneMask dark, const std::vector<Shade<Value>>& shaded,
           std::vector<Value>& image) const;
  template <typename Value>
  void add_sample(std::size_t pixel, const Value& radiance, const std::vector<Shade<Value>>& shaded,
                  std::vector<Value>& image) const;

  /// Casts the rays; the direction has z = 1 in the camera frame.
  void trace(const Aim& aim, SurfaceHits& hits) const;
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
  Deferred deferred_;
};

}  // namespace km
