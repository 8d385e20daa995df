#include "apps/lab/simulation/rendering/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

#include "apps/lab/simulation/rendering/surface_shader.hpp"

namespace km {
namespace {

constexpr int kBlock = 4;  // a packet covers 4 x 4 pixels
static_assert(kBlock * kBlock == kLanes);

// Sample i is in column i of a square grid, in the row given here. Among all such sets, these were
// found by search: the count on one side of a straight edge follows the area best, over all edges.
constexpr std::array<int, 4> kSampleRows = {1, 3, 0, 2};  // for a pixel with an edge
constexpr std::array<int, 16> kThinRows = {4, 13, 8, 0, 5, 11, 14, 2, 9, 6, 12, 1, 7, 15, 3, 10};

// Offset of sample `i` from the pixel's centre.
template <std::size_t kCount>
Eigen::Vector2f sample_offset(const std::array<int, kCount>& rows, std::size_t i) {
  constexpr auto count = static_cast<float>(kCount);
  return {(static_cast<float>(i) + 0.5F) / count - 0.5F,
          (static_cast<float>(rows[i]) + 0.5F) / count - 0.5F};
}

float lit(const Shade& shade, bool dark) {
  return dark ? shade.ambient : shade.ambient + shade.sun;
}

void copy_lane(const Lanes3& from, std::size_t lane, Lanes3& to, std::size_t to_lane) {
  to.set(to_lane, from.at(lane));
}

void copy_lane(const SurfaceHits& from, std::size_t lane, SurfaceHits& to, std::size_t to_lane) {
  const RTCRay16& a = from.rays.ray;
  RTCRay16& b = to.rays.ray;
  b.org_x[to_lane] = a.org_x[lane];
  b.org_y[to_lane] = a.org_y[lane];
  b.org_z[to_lane] = a.org_z[lane];
  b.dir_x[to_lane] = a.dir_x[lane];
  b.dir_y[to_lane] = a.dir_y[lane];
  b.dir_z[to_lane] = a.dir_z[lane];
  b.tfar[to_lane] = a.tfar[lane];
  to.rays.hit.primID[to_lane] = from.rays.hit.primID[lane];
  to.rays.hit.u[to_lane] = from.rays.hit.u[lane];
  to.rays.hit.v[to_lane] = from.rays.hit.v[lane];
  copy_lane(from.right, lane, to.right, to_lane);
  copy_lane(from.down, lane, to.down, to_lane);
  const LaneMask bit = 1U << to_lane;
  to.active |= bit;
  if (has_lane(from.surface, lane)) to.surface |= bit;
}

// One call of Renderer::render(): a ray and a shade per pixel, then more rays in pixels with edges.
class ViewPass {
 public:
  ViewPass(const SceneView& view, const PixelRays& rays, std::span<const SE3> T_world_body,
           const RenderRequest& request)
      : at_(view),
        scene_(view.fixed),
        surfaces_(view.surfaces()),
        rays_(rays),
        request_(request),
        width_(rays.camera().width),
        height_(rays.camera().height) {
    for (const SE3& T : T_world_body) {
      const SE3 T_world_cam = T * rays.camera().T_body_cam;
      poses_.push_back(
          {T_world_cam.linear().cast<float>(), T_world_cam.translation().cast<float>()});
    }
    view_.width = width_;
    view_.height = height_;
    const std::size_t n = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    pixels_.resize(n);
    if (request.radiance) shades_.resize(n);
    if (request.radiance) view_.radiance.resize(n);
    if (request.depth) view_.depth_m.resize(n);
    if (request.labels) view_.labels.resize(n);
  }

  [[nodiscard]] RenderedView run() {
    for (int y = 0; y < height_; y += kBlock)
      for (int x = 0; x < width_; x += kBlock) shade_block(x, y);
    if (request_.radiance) {
      edge_.assign(pixels_.size(), kNoEdge);
      compare_neighbours();
      for (int y = 0; y < height_; y += kBlock)
        for (int x = 0; x < width_; x += 2 * kBlock) find_thin_things(x, y);
      refine_edges();
    }
    return std::move(view_);
  }

 private:
  /// Pose of the camera.
  struct Pose {
    Eigen::Matrix3f R_world_cam;
    Eigen::Vector3f origin;
  };
  /// Data on a pixel's centre that the second pass needs.
  struct Pixel {
    std::uint32_t triangle = kNoTriangle;
    float depth_m = 0.0F;
    std::uint16_t material = kSkyMaterial;
    bool foliage = false;
    bool dark = false;  ///< The sun is hidden.
  };
  static constexpr std::uint16_t kSkyMaterial = 0xFFFF;
  /// Pixel of each lane, and the offset of its ray from the pixel's centre [px].
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
  /// Position of an edge in a pixel: towards a neighbour, or anywhere; and whether it may be that
  /// of a shadow.
  enum Edge : std::uint8_t {
    kNoEdge = 0,
    kLeft = 1,
    kRight = 2,
    kUp = 4,
    kDown = 8,
    kInside = 16,
    kShadow = 32,
  };
  struct Sample {
    int x = 0, y = 0;
    Eigen::Vector2f offset = Eigen::Vector2f::Zero();  ///< From the pixel's centre [px].
  };
  /// Samples without a shade: they wait until there are enough for a packet.
  struct Deferred {
    SurfaceHits hits{};
    std::size_t count = 0;
    std::array<std::size_t, kLanes> pixel{};   ///< Pixel of the sample.
    std::array<std::size_t, kLanes> source{};  ///< Pixel whose shade the sample takes,
    LaneMask fresh = 0;  ///< unless it is in this mask and must be shaded itself.
  };

  void trace(const Aim& aim, SurfaceHits& hits) const {
    // Bearing of each pixel, and its change to the right and down. Inactive lanes repeat some
    // pixel, so that the loops have no branches and are vectorised.
    Lanes x, y, right_x, right_y, down_x, down_y;
    const Eigen::Vector2f* bearings = rays_.bearings().data();
    const std::ptrdiff_t stride = rays_.stride();
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Eigen::Vector2f* bearing = bearings + aim.y[lane] * stride + aim.x[lane];
      right_x[lane] = bearing[1].x() - bearing[0].x();
      right_y[lane] = bearing[1].y() - bearing[0].y();
      down_x[lane] = bearing[stride].x() - bearing[0].x();
      down_y[lane] = bearing[stride].y() - bearing[0].y();
      x[lane] = bearing[0].x();
      y[lane] = bearing[0].y();
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      x[lane] += aim.dx[lane] * right_x[lane] + aim.dy[lane] * down_x[lane];
      y[lane] += aim.dx[lane] * right_y[lane] + aim.dy[lane] * down_y[lane];
    }
    const auto rotate = [&](int row, float* direction, Lanes& right, Lanes& down, float* origin) {
      const auto turn = [&](std::size_t lane, float a, float b, float c, float from) {
        direction[lane] = a * x[lane] + b * y[lane] + c;
        right[lane] = a * right_x[lane] + b * right_y[lane];
        down[lane] = a * down_x[lane] + b * down_y[lane];
        origin[lane] = from;
      };
      if (poses_.size() == 1) {
        const auto& [R, from] = poses_.front();
        const float a = R(row, 0), b = R(row, 1), c = R(row, 2), at = from[row];
        for (std::size_t lane = 0; lane < kLanes; ++lane) turn(lane, a, b, c, at);
        return;
      }
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const auto& [R, from] = pose(aim.y[lane]);
        turn(lane, R(row, 0), R(row, 1), R(row, 2), from[row]);
      }
    };
    rotate(0, hits.rays.ray.dir_x, hits.right.x, hits.down.x, hits.rays.ray.org_x);
    rotate(1, hits.rays.ray.dir_y, hits.right.y, hits.down.y, hits.rays.ray.org_y);
    rotate(2, hits.rays.ray.dir_z, hits.right.z, hits.down.z, hits.rays.ray.org_z);
    std::fill_n(hits.rays.ray.tnear, kLanes, 0.0F);
    std::fill_n(hits.rays.ray.tfar, kLanes, std::numeric_limits<float>::infinity());

    hits.active = aim.active;
    at_.intersect(aim.active, hits.rays);
    hits.surface = 0;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      hits.surface |= static_cast<LaneMask>(hits.rays.hit.primID[lane] != kNoTriangle) << lane;
    hits.surface &= aim.active;
  }

  void shade_block(int x0, int y0) {
    Aim aim;
    for (int y = y0; y < std::min(y0 + kBlock, height_); ++y)
      for (int x = x0; x < std::min(x0 + kBlock, width_); ++x)
        if (rays_.is_lit(index(x, y)))
          aim.set(static_cast<std::size_t>((y - y0) * kBlock + x - x0), x, y, {0.0F, 0.0F});
    if (aim.active == 0) return;
    SurfaceHits hits;
    trace(aim, hits);
    SurfacePoints points;
    LaneMask dark = 0;
    if (request_.radiance) {
      locate(surfaces_, hits, points);
      if (scene_.lighting.sun > 0.0F) dark = shadowed(at_, hits.surface, points);
    }
    store_block(aim, hits, points, dark);
  }

  void store_block(const Aim& aim, const SurfaceHits& hits, const SurfacePoints& points,
                   LaneMask dark) {
    Shades shades;
    if (request_.radiance) shade(scene_, hits, points, hits.active, shades);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (!has_lane(hits.active, lane)) continue;
      const std::size_t i = index(aim.x[lane], aim.y[lane]);
      const bool surface = has_lane(hits.surface, lane);
      const float depth_m = surface ? hits.rays.ray.tfar[lane] : 0.0F;
      const bool is_dark = has_lane(dark, lane);
      pixels_[i] = {hits.rays.hit.primID[lane], depth_m, kSkyMaterial, false, is_dark};
      if (surface) {
        pixels_[i].material = surfaces_.record(pixels_[i].triangle).material;
        pixels_[i].foliage = surfaces_.material_of(pixels_[i].triangle).foliage;
      }
      if (request_.radiance) {
        shades_[i] = shades[lane];
        view_.radiance[i] = shades[lane].ambient + (is_dark ? 0.0F : shades[lane].sun);
      }
      if (request_.depth) view_.depth_m[i] = depth_m;
      if (request_.labels)
        view_.labels[i] = surface ? surfaces_.material_of(pixels_[i].triangle).label
                                  : static_cast<LabelId>(SurfaceClass::kSky);
    }
  }

  [[nodiscard]] Eigen::Vector3f position(std::size_t pixel) const {
    const std::size_t y = pixel / static_cast<std::size_t>(width_);
    // A row of bearings has one more than a row of pixels.
    const Eigen::Vector2f& bearing = rays_.bearings()[pixel + y];
    const auto& [R_world_cam, origin] = pose(static_cast<int>(y));
    return origin + pixels_[pixel].depth_m * (R_world_cam * bearing.homogeneous());
  }

  // True for the same material and nearly one plane.
  [[nodiscard]] bool same_surface(std::size_t pixel, std::uint32_t triangle,
                                  const Eigen::Vector3f& point) const {
    const Pixel& at = pixels_[pixel];
    if (at.triangle == triangle) return true;
    if (at.triangle == kNoTriangle || triangle == kNoTriangle) return false;
    const SurfaceRecord& other = surfaces_.record(triangle);
    if (at.material != other.material) return false;
    const SurfaceRecord& surface = surfaces_.record(at.triangle);
    constexpr float kLeastCosine = 0.95F;  // 18 degrees
    if (std::abs(surface.normal.dot(other.normal)) < kLeastCosine) return false;
    // The distance from the plane is less than about the size of a pixel.
    const float pixel_m = at.depth_m / static_cast<float>(rays_.camera().fx);
    return std::abs(surface.normal.dot(point - position(pixel))) < pixel_m;
  }

  // True if the radiances of two pixels differ enough for their mean to be visible.
  [[nodiscard]] bool contrast(std::size_t a, std::size_t b) const {
    constexpr float kVisible = 0.05F;  // steps of some grey levels; the lens blurs them away
    const float at_a = view_.radiance[a];
    const float at_b = view_.radiance[b];
    return std::abs(at_a - at_b) > kVisible * std::max(at_a, at_b);
  }

  // Marks the edges of two neighbouring pixels towards each other.
  void compare(std::size_t a, Edge towards_b, std::size_t b, Edge towards_a) {
    if (!rays_.is_lit(a) || !rays_.is_lit(b)) return;
    const bool one_triangle = pixels_[a].triangle == pixels_[b].triangle;
    const bool one_light = pixels_[a].dark == pixels_[b].dark;
    if ((one_triangle && one_light) || !contrast(a, b)) return;
    const bool one_surface = one_triangle || same_surface(a, pixels_[b].triangle, position(b));
    if (one_surface && one_light) return;
    const Edge kind = one_surface ? kShadow : kNoEdge;
    edge_[a] |= static_cast<std::uint8_t>(towards_b | kind);
    edge_[b] |= static_cast<std::uint8_t>(towards_a | kind);
  }

  void compare_neighbours() {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (x + 1 < width_) compare(index(x, y), kRight, index(x + 1, y), kLeft);
        if (y + 1 < height_) compare(index(x, y), kDown, index(x, y + 1), kUp);
      }
    }
  }

  // Poles and wires narrower than a pixel can pass between all centres of a row or column.
  // Additional rays at alternating pixels of each block of 8 x 4 find most of them. Pixels with a
  // known edge need none.
  void find_thin_things(int x0, int y0) {
    // Nothing in front of surfaces nearer than this is narrower than a pixel.
    constexpr float kThinnest_m = 0.02F;
    const float nearest_m = kThinnest_m * static_cast<float>(rays_.camera().fx);
    Aim aim;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const int row = static_cast<int>(lane) / 4;
      const int x = x0 + 2 * (static_cast<int>(lane) % 4) + row % 2;
      const int y = y0 + row;
      if (x >= width_ || y >= height_ || edge_[index(x, y)] != kNoEdge) continue;
      if (!rays_.is_lit(index(x, y))) continue;
      const float depth_m = pixels_[index(x, y)].depth_m;
      if (depth_m > 0.0F && depth_m < nearest_m) continue;
      aim.set(lane, x, y, sample_offset(kThinRows, (5 * lane + 3) % kLanes));
    }
    if (aim.active == 0) return;
    SurfaceHits hits;
    trace(aim, hits);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (!has_lane(aim.active, lane)) continue;
      const std::uint32_t triangle = hits.rays.hit.primID[lane];
      if (triangle == pixels_[index(aim.x[lane], aim.y[lane])].triangle) continue;
      const Eigen::Vector3f d(hits.rays.ray.dir_x[lane], hits.rays.ray.dir_y[lane],
                              hits.rays.ray.dir_z[lane]);
      const Eigen::Vector3f& origin = pose(aim.y[lane]).origin;
      const Eigen::Vector3f hit =
          triangle == kNoTriangle ? origin : Eigen::Vector3f(origin + hits.rays.ray.tfar[lane] * d);
      flag_unlike(aim.x[lane], aim.y[lane], triangle, hit);
    }
  }

  // A hit beside a pixel's centre on another surface shows that an edge runs through the pixel. If
  // no neighbour shows that surface either, it is thin, and likely continues beside the pixel
  // without being seen. Leaves do not continue.
  void flag_unlike(int x, int y, std::uint32_t triangle, const Eigen::Vector3f& hit) {
    const auto like = [&](int px, int py) { return same_surface(index(px, py), triangle, hit); };
    if (like(x, y)) return;
    edge_[index(x, y)] |= kInside;
    const bool seen = (x > 0 && like(x - 1, y)) || (y > 0 && like(x, y - 1)) ||
                      (x + 1 < width_ && like(x + 1, y)) || (y + 1 < height_ && like(x, y + 1));
    if (seen || pixels_[index(x, y)].foliage) return;
    constexpr int kReach = 3;
    for (int dy = -kReach; dy <= kReach; ++dy) {
      const int side = kReach - std::abs(dy);
      if (y + dy < 0 || y + dy >= height_) continue;
      for (int px = std::max(x - side, 0); px <= std::min(x + side, width_ - 1); ++px)
        edge_[index(px, y + dy)] |= kInside;
    }
  }

  // True if a sample on this side of a pixel's centre may see the surface beyond the pixel's edge.
  [[nodiscard]] static bool beyond_edge(std::uint8_t edge, const Eigen::Vector2f& offset) {
    const int across = offset.x() < 0.0F ? kLeft : kRight;
    const int along = offset.y() < 0.0F ? kUp : kDown;
    return (edge & (kInside | across | along)) != 0;
  }

  // Sets each pixel with an edge to the mean of its centre and its samples. Samples away from the
  // edge have the value of the centre.
  void refine_edges() {
    std::vector<Sample> batch;
    batch.reserve(kLanes);
    const auto refine_pixel = [&](int x, int y) {
      const std::uint8_t edge = edge_[index(x, y)];
      if (edge == kNoEdge || !rays_.is_lit(index(x, y))) return;
      for (std::size_t i = 0; i < kSampleRows.size(); ++i) {
        const Eigen::Vector2f offset = sample_offset(kSampleRows, i);
        if (!beyond_edge(edge, offset)) continue;
        batch.push_back({x, y, offset});
        if (batch.size() < kLanes) continue;
        refine(batch);
        batch.clear();
      }
    };
    // Goes tile by tile, so that samples traced together are near each other.
    constexpr int kTile = 4;
    for (int y0 = 0; y0 < height_; y0 += kTile)
      for (int x0 = 0; x0 < width_; x0 += kTile)
        for (int y = y0; y < std::min(y0 + kTile, height_); ++y)
          for (int x = x0; x < std::min(x0 + kTile, width_); ++x) refine_pixel(x, y);
    refine(batch);
    light_deferred();
  }

  // True if the centre of a pixel shows a surface similar to one at `depth_m`: the same material at
  // about the same distance and slope. For leaves the slope does not matter.
  [[nodiscard]] bool alike(const Pixel& pixel, const SurfaceRecord& surface, float depth_m) const {
    if (pixel.material != surface.material) return false;
    constexpr float kDepthShare = 0.03F;
    if (std::abs(pixel.depth_m - depth_m) > kDepthShare * depth_m) return false;
    constexpr float kLeastCosine = 0.95F;  // 18 degrees
    return pixel.foliage ||
           surfaces_.record(pixel.triangle).normal.dot(surface.normal) > kLeastCosine;
  }

  // A pixel whose shade can be used for a sample that hit `triangle`. Candidates are the sample's
  // own pixel and its neighbours on that side, if they show the same triangle or a similar surface.
  [[nodiscard]] std::optional<std::size_t> shaded_nearby(const Sample& sample,
                                                         std::uint32_t triangle,
                                                         float depth_m) const {
    const std::size_t pixel = index(sample.x, sample.y);
    if (pixels_[pixel].triangle == triangle) return pixel;
    const int side_x = std::clamp(sample.x + (sample.offset.x() < 0.0F ? -1 : 1), 0, width_ - 1);
    const int side_y = std::clamp(sample.y + (sample.offset.y() < 0.0F ? -1 : 1), 0, height_ - 1);
    const bool across = std::abs(sample.offset.x()) > std::abs(sample.offset.y());
    const std::size_t nearer = across ? index(side_x, sample.y) : index(sample.x, side_y);
    const std::size_t farther = across ? index(sample.x, side_y) : index(side_x, sample.y);
    for (const std::size_t other : {nearer, farther, index(side_x, side_y)})
      if (pixels_[other].triangle == triangle && rays_.is_lit(other)) return other;
    if (triangle == kNoTriangle) return std::nullopt;
    const SurfaceRecord& surface = surfaces_.record(triangle);
    for (const std::size_t other : {nearer, farther, pixel})
      if (alike(pixels_[other], surface, depth_m)) return other;
    return std::nullopt;
  }

  // A sample takes the shade of a pixel nearby, or is deferred to be shaded together with others.
  // At the edges of shadows a ray to the sun is traced for each sample.
  void refine(std::span<const Sample> batch) {
    Aim aim;
    for (std::size_t lane = 0; lane < batch.size(); ++lane)
      aim.set(lane, batch[lane].x, batch[lane].y, batch[lane].offset);
    SurfaceHits hits;
    trace(aim, hits);
    for (std::size_t lane = 0; lane < batch.size(); ++lane) {
      const std::size_t pixel = index(batch[lane].x, batch[lane].y);
      const auto source =
          shaded_nearby(batch[lane], hits.rays.hit.primID[lane], hits.rays.ray.tfar[lane]);
      const bool ask_sun = has_lane(hits.surface, lane) && (edge_[pixel] & kShadow) != 0;
      if (!source || ask_sun) {
        defer(hits, lane, pixel, source);
      } else if (*source != pixel) {
        add_sample(pixel, lit(shades_[*source], pixels_[*source].dark));
      }
    }
  }

  // Adds a sample without known light to the packet of those that are shaded together.
  void defer(const SurfaceHits& hits, std::size_t lane, std::size_t pixel,
             std::optional<std::size_t> source) {
    const std::size_t to = deferred_.count++;
    const LaneMask bit = 1U << to;
    copy_lane(hits, lane, deferred_.hits, to);
    deferred_.pixel[to] = pixel;
    deferred_.source[to] = source.value_or(pixel);
    if (!source) deferred_.fresh |= bit;
    if (deferred_.count == kLanes) light_deferred();
  }

  void light_deferred() {
    const SurfaceHits& hits = deferred_.hits;
    SurfacePoints points;
    locate(surfaces_, hits, points);
    LaneMask dark = 0;
    if (scene_.lighting.sun > 0.0F) dark = shadowed(at_, hits.surface, points);
    Shades shades;
    shade(scene_, hits, points, deferred_.fresh, shades);
    for (std::size_t i = 0; i < deferred_.count; ++i) {
      const Shade& light = has_lane(deferred_.fresh, i) ? shades[i] : shades_[deferred_.source[i]];
      add_sample(deferred_.pixel[i], lit(light, has_lane(dark, i)));
    }
    deferred_ = {};
  }

  // In the mean of a pixel's centre and samples, missing samples count as the centre.
  void add_sample(std::size_t pixel, float radiance) {
    constexpr float kWeight = 1.0F / static_cast<float>(kSampleRows.size() + 1);
    view_.radiance[pixel] += kWeight * (radiance - lit(shades_[pixel], pixels_[pixel].dark));
  }

  [[nodiscard]] const Pose& pose(int row) const {
    return poses_.size() == 1 ? poses_.front() : poses_[static_cast<std::size_t>(row)];
  }

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  const SceneView at_;
  const RenderScene& scene_;
  const SurfaceView surfaces_;
  const PixelRays& rays_;
  const RenderRequest& request_;
  int width_;
  int height_;
  std::vector<Pose> poses_;  ///< One, or one for each row.

  RenderedView view_;
  std::vector<Pixel> pixels_;
  std::vector<std::uint8_t> edge_;  ///< flags of Edge
  std::vector<Shade> shades_;
  Deferred deferred_;
};

}  // namespace

PixelRays::PixelRays(const Camera& camera) : camera_(camera) {
  const auto columns = static_cast<std::size_t>(stride());
  const std::size_t size = columns * static_cast<std::size_t>(camera.height + 1);
  bearings_.reserve(size);
  std::vector<std::uint8_t> has_bearing;
  has_bearing.reserve(size);
  for (int y = 0; y <= camera.height; ++y) {
    for (int x = 0; x <= camera.width; ++x) {
      const auto bearing = camera.unproject(Eigen::Vector2d(x, y));
      bearings_.push_back(bearing.value_or(Eigen::Vector2d::Zero()).cast<float>());
      has_bearing.push_back(bearing ? 1 : 0);
    }
  }
  lit_.reserve(size);
  for (std::size_t i = 0; i + columns < size; ++i)
    if ((i + 1) % columns != 0)
      lit_.push_back(static_cast<std::uint8_t>(has_bearing[i] & has_bearing[i + 1] &
                                               has_bearing[i + columns]));
}

Camera shrunk(const Camera& camera, int factor) {
  Camera small = camera;
  small.width = (camera.width + factor - 1) / factor;
  small.height = (camera.height + factor - 1) / factor;
  small.fx /= factor;
  small.fy /= factor;
  // The corner of the image, half a pixel before the first centre, does not move.
  small.cx = (camera.cx + 0.5) / factor - 0.5;
  small.cy = (camera.cy + 0.5) / factor - 0.5;
  return small;
}

Renderer::Renderer(const World& world) : scene_(new RenderScene(world)) {}

Renderer::~Renderer() = default;

RenderedView Renderer::render(const PixelRays& rays, const SE3& T_world_body,
                              const RenderRequest& request) const {
  return render(rays, std::span(&T_world_body, 1), request);
}

RenderedView Renderer::render(const PixelRays& rays, std::span<const SE3> T_world_body,
                              const RenderRequest& request, const MovedSurfaces* moved) const {
  return ViewPass({*scene_, moved}, rays, T_world_body, request).run();
}

std::vector<LightSource> Renderer::visible_lights(const SE3& T_world_body) const {
  const Lighting& lighting = scene_->lighting;
  const Eigen::Vector3f origin = T_world_body.translation().cast<float>();
  std::vector<LightSource> lights;
  const auto add_if_visible = [&](const Eigen::Vector3f& to_light, float irradiance, float far) {
    RayPacket rays;
    set_ray(rays, 0, origin, to_light, 0.0F, far);
    if (scene_->tracer.occluded(1U, rays) != 0) return;
    lights.push_back({T_world_body.linear().transpose() * to_light.cast<double>(),
                      static_cast<double>(irradiance)});
  };
  if (lighting.sun > 0.0F)
    add_if_visible(lighting.to_sun, lighting.sun, std::numeric_limits<float>::infinity());
  for (const Lighting::Lamp& lamp : lighting.lamps) {
    constexpr float kLampRadius_m = 0.3F;  // surfaces of the lamp itself hide nothing
    const Eigen::Vector3f way = lamp.position - origin;
    const float distance_m = std::max(way.norm(), 2.0F * kLampRadius_m);
    add_if_visible(way / distance_m, lamp.intensity / (distance_m * distance_m),
                   distance_m - kLampRadius_m);
  }
  return lights;
}

}  // namespace km
