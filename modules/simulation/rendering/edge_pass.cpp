#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "modules/simulation/rendering/view_pass.hpp"

namespace km {
namespace {

// Sample i of n lies in column i of an n x n grid, in the row given here: of all such sets, those
// whose count on one side of a straight edge follows the area best, over all edges (by search).
constexpr std::array<int, 4> kRows4 = {1, 3, 0, 2};
constexpr std::array<int, 8> kRows8 = {7, 2, 4, 1, 6, 3, 5, 0};
constexpr std::array<int, 16> kRows16 = {4, 13, 8, 0, 5, 11, 14, 2, 9, 6, 12, 1, 7, 15, 3, 10};

// From the pixel's centre; n is 2, 4, 8 or 16.
Eigen::Vector2f sample_offset(std::size_t i, std::size_t n) {
  const int row = n == 16  ? kRows16[i]
                  : n == 8 ? kRows8[i]
                  : n == 4 ? kRows4[i]
                           : static_cast<int>(i);
  const auto count = static_cast<float>(n);
  return {(static_cast<float>(i) + 0.5F) / count - 0.5F,
          (static_cast<float>(row) + 0.5F) / count - 0.5F};
}

template <typename Value>
Value lit(const Shade<Value>& shade, bool dark) {
  return dark ? shade.ambient : Value(shade.ambient + shade.sun);
}

}  // namespace

Eigen::Vector3f ViewPass::position(int x, int y) const {
  const Eigen::Vector2f& bearing =
      rays_.bearings()[static_cast<std::size_t>(y) * static_cast<std::size_t>(rays_.stride()) +
                       static_cast<std::size_t>(x)];
  return origin_ + pixels_[index(x, y)].depth_m * (R_world_cam_ * bearing.homogeneous());
}

// Two triangles hit side by side look like one surface: the same material, nearly one plane.
bool ViewPass::same_surface(std::uint32_t a, const Eigen::Vector3f& at_a, std::uint32_t b,
                            const Eigen::Vector3f& at_b) const {
  if (a == b) return true;
  if (a == kNoTriangle || b == kNoTriangle) return false;
  const SurfaceRecord& surface_a = scene_.surfaces.record(a);
  const SurfaceRecord& surface_b = scene_.surfaces.record(b);
  if (surface_a.material != surface_b.material) return false;
  constexpr float kLeastCosine = 0.95F;  // 18 degrees
  if (std::abs(surface_a.normal.dot(surface_b.normal)) < kLeastCosine) return false;
  const float pixel_m =
      (at_a - origin_).norm() / static_cast<float>(rays_.camera().fx);  // what a pixel covers
  return std::abs(surface_a.normal.dot(at_b - at_a)) < pixel_m;
}

void ViewPass::compare(std::size_t a, std::size_t b) {
  std::uint8_t edge = kNoEdge;
  if (pixels_[a].triangle != pixels_[b].triangle) {
    const int width = width_;
    const auto at = [this, width](std::size_t i) {
      const int pixel = static_cast<int>(i);
      return position(pixel % width, pixel / width);
    };
    if (!same_surface(pixels_[a].triangle, at(a), pixels_[b].triangle, at(b))) edge = kShapeEdge;
  }
  if (edge == kNoEdge && dark_[a] != dark_[b]) edge = kShadowEdge;
  edge_[a] |= edge;
  edge_[b] |= edge;
}

void ViewPass::compare_neighbours() {
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (x + 1 < width_) compare(index(x, y), index(x + 1, y));
      if (y + 1 < height_) compare(index(x, y), index(x, y + 1));
    }
  }
}

// Poles and wires narrower than a pixel can pass between all centres of a row or column. One more
// ray per pixel, elsewhere in each pixel of a block, finds most of them.
void ViewPass::find_thin_things(int x0, int y0) {
  Aim aim = aim_at_block(x0, y0);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Eigen::Vector2f offset = sample_offset((5 * lane + 3) % kLanes, kLanes);
    aim.dx[lane] = offset.x();
    aim.dy[lane] = offset.y();
  }
  SurfaceHits hits;
  trace(aim, lanes_inside(aim), hits);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if ((hits.active >> lane & 1U) == 0U) continue;
    const std::uint32_t triangle = hits.rays.hit.primID[lane];
    if (triangle == pixels_[index(aim.x[lane], aim.y[lane])].triangle) continue;
    const Eigen::Vector3f d(hits.rays.ray.dir_x[lane], hits.rays.ray.dir_y[lane],
                            hits.rays.ray.dir_z[lane]);
    const Eigen::Vector3f hit =
        triangle == kNoTriangle ? origin_ : Eigen::Vector3f(origin_ + hits.rays.ray.tfar[lane] * d);
    flag_unlike(aim.x[lane], aim.y[lane], triangle, hit);
  }
}

// A hit beside a pixel's centre that is another surface: an edge runs through the pixel. If no
// neighbour shows that surface either, it is thin, and likely runs on unseen beside the pixel.
void ViewPass::flag_unlike(int x, int y, std::uint32_t triangle, const Eigen::Vector3f& hit) {
  const auto like = [&](int px, int py) {
    const std::uint32_t other = pixels_[index(px, py)].triangle;
    return other == triangle || same_surface(other, position(px, py), triangle, hit);
  };
  if (like(x, y)) return;
  edge_[index(x, y)] |= kShapeEdge;
  const bool seen = (x > 0 && like(x - 1, y)) || (y > 0 && like(x, y - 1)) ||
                    (x + 1 < width_ && like(x + 1, y)) || (y + 1 < height_ && like(x, y + 1));
  if (seen) return;
  constexpr int kReach = 2;
  for (int dy = -kReach; dy <= kReach; ++dy) {
    const int side = kReach - std::abs(dy);
    if (y + dy < 0 || y + dy >= height_) continue;
    for (int px = std::max(x - side, 0); px <= std::min(x + side, width_ - 1); ++px)
      edge_[index(px, y + dy)] |= kShapeEdge;
  }
}

void ViewPass::refine_edges() {
  std::vector<std::size_t> pixels;
  for (std::size_t i = 0; i < edge_.size(); ++i)
    if (edge_[i] != kNoEdge) pixels.push_back(i);
  const std::size_t per_packet = static_cast<std::size_t>(kLanes / samples_);
  for (std::size_t begin = 0; begin < pixels.size(); begin += per_packet)
    refine(std::span(pixels).subspan(begin, std::min(per_packet, pixels.size() - begin)));
}

// A pixel around `pixel` whose centre lies on `triangle`: its shade serves for a sample there.
std::optional<std::size_t> ViewPass::shaded_nearby(std::size_t pixel,
                                                   std::uint32_t triangle) const {
  if (pixels_[pixel].triangle == triangle) return pixel;
  const int x = static_cast<int>(pixel) % width_;
  const int y = static_cast<int>(pixel) / width_;
  for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, height_ - 1); ++ny)
    for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, width_ - 1); ++nx)
      if (pixels_[index(nx, ny)].triangle == triangle) return index(nx, ny);
  return std::nullopt;
}

// Replaces each pixel by the mean of its samples. A sample takes the shade of the nearest pixel on
// its triangle, or is shaded itself; at shadows' edges each sample asks for the sun itself.
void ViewPass::refine(std::span<const std::size_t> pixels) {
  const auto samples = static_cast<std::size_t>(samples_);
  Aim aim;
  LaneMask active = 0;
  for (std::size_t lane = 0; lane < pixels.size() * samples; ++lane) {
    const int pixel = static_cast<int>(pixels[lane / samples]);
    const Eigen::Vector2f offset = sample_offset(lane % samples, samples);
    aim.x[lane] = pixel % width_;
    aim.y[lane] = pixel / width_;
    aim.dx[lane] = offset.x();
    aim.dy[lane] = offset.y();
    active |= 1U << lane;
  }
  SurfaceHits hits;
  trace(aim, active, hits);

  std::array<std::size_t, kLanes> source{};
  LaneMask fresh = 0;
  LaneMask dark = 0;
  LaneMask ask_sun = 0;
  for (std::size_t lane = 0; lane < pixels.size() * samples; ++lane) {
    const std::size_t pixel = pixels[lane / samples];
    const auto nearby = shaded_nearby(pixel, hits.rays.hit.primID[lane]);
    if (nearby) source[lane] = *nearby;
    if (!nearby) fresh |= 1U << lane;
    if (nearby && dark_[*nearby] != 0) dark |= 1U << lane;
    if (!nearby || (edge_[pixel] & kShadowEdge) != 0) ask_sun |= 1U << lane;
  }
  SurfacePoints points;
  const LaneMask surface = hits.surface;
  hits.surface &= fresh | ask_sun;
  locate(scene_.surfaces, hits, points);
  if (options_.shadows && scene_.lighting.sun > 0.0F) {
    ask_sun &= surface;
    dark = (dark & ~ask_sun) | shadowed(scene_, ask_sun, points);
  }
  average<float>(pixels, hits, points, SampleLanes{fresh, dark}, source, gray_, view_.radiance);
  average<Eigen::Vector3f>(pixels, hits, points, SampleLanes{fresh, dark}, source, color_,
                           view_.rgb);
}

template <typename Value>
void ViewPass::average(std::span<const std::size_t> pixels, const SurfaceHits& hits,
                       const SurfacePoints& points, const SampleLanes& lanes,
                       const std::array<std::size_t, kLanes>& source,
                       const std::vector<Shade<Value>>& shaded, std::vector<Value>& image) const {
  if (image.empty()) return;
  std::array<Shade<Value>, kLanes> shades;
  shade(scene_, hits, points, lanes.fresh, shades);
  const auto samples = static_cast<std::size_t>(samples_);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    Value sum = 0.0F * image[pixels[p]];
    for (std::size_t lane = p * samples; lane < (p + 1) * samples; ++lane) {
      const bool fresh = (lanes.fresh >> lane & 1U) != 0U;
      sum += lit(fresh ? shades[lane] : shaded[source[lane]], (lanes.dark >> lane & 1U) != 0U);
    }
    image[pixels[p]] = sum / static_cast<float>(samples);
  }
}

}  // namespace km
