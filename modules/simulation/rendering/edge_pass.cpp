#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "modules/simulation/rendering/luminance.hpp"
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

Eigen::Vector3f ViewPass::position(std::size_t pixel) const {
  const std::size_t y = pixel / static_cast<std::size_t>(width_);
  // A row of bearings has one more than a row of pixels.
  const Eigen::Vector2f& bearing = rays_.bearings()[pixel + y];
  return origin_ + pixels_[pixel].depth_m * (R_world_cam_ * bearing.homogeneous());
}

// The same material, nearly one plane.
bool ViewPass::same_surface(std::size_t pixel, std::uint32_t triangle,
                            const Eigen::Vector3f& point) const {
  const Pixel& at = pixels_[pixel];
  if (at.triangle == triangle) return true;
  if (at.triangle == kNoTriangle || triangle == kNoTriangle) return false;
  const SurfaceRecord& other = scene_.surfaces.record(triangle);
  if (at.material != other.material) return false;
  const SurfaceRecord& surface = scene_.surfaces.record(at.triangle);
  constexpr float kLeastCosine = 0.95F;  // 18 degrees
  if (std::abs(surface.normal.dot(other.normal)) < kLeastCosine) return false;
  // Off the plane by less than about what a pixel covers.
  const float pixel_m = at.depth_m / static_cast<float>(rays_.camera().fx);
  return std::abs(surface.normal.dot(point - position(pixel))) < pixel_m;
}

// The kind of edge between a pixel and another surface.
ViewPass::Edge ViewPass::edge_towards(std::size_t pixel, std::uint32_t triangle) const {
  if (pixels_[pixel].foliage) return kLeafEdge;
  if (triangle == kNoTriangle) return kShapeEdge;
  return scene_.surfaces.material(scene_.surfaces.record(triangle)).foliage ? kLeafEdge
                                                                            : kShapeEdge;
}

// Whether the radiances of two pixels differ by so much that a mean of them is seen as such.
bool ViewPass::contrast(std::size_t a, std::size_t b) const {
  constexpr float kVisible = 0.03F;  // a grey level or two, at any exposure
  const float at_a = request_.radiance ? view_.radiance[a] : luminance_of(view_.rgb[a]);
  const float at_b = request_.radiance ? view_.radiance[b] : luminance_of(view_.rgb[b]);
  return std::abs(at_a - at_b) > kVisible * std::max(at_a, at_b);
}

void ViewPass::compare(std::size_t a, std::size_t b) {
  if (!contrast(a, b)) return;
  std::uint8_t edge = kNoEdge;
  if (pixels_[a].triangle != pixels_[b].triangle) {
    if (pixels_[a].material != pixels_[b].material ||
        !same_surface(a, pixels_[b].triangle, position(b)))
      edge = pixels_[a].foliage || pixels_[b].foliage ? kLeafEdge : kShapeEdge;
  }
  if (edge == kNoEdge && pixels_[a].dark != pixels_[b].dark) edge = kShadowEdge;
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
// ray in every other pixel of 8 x 4, elsewhere in each, finds most of them. Where an edge is known
// already there is no need.
void ViewPass::find_thin_things(int x0, int y0) {
  Aim aim;
  LaneMask active = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const int row = static_cast<int>(lane) / 4;
    aim.x[lane] = x0 + 2 * (static_cast<int>(lane) % 4) + row % 2;
    aim.y[lane] = y0 + row;
    const Eigen::Vector2f offset = sample_offset((5 * lane + 3) % kLanes, kLanes);
    aim.dx[lane] = offset.x();
    aim.dy[lane] = offset.y();
    const bool inside = aim.x[lane] < width_ && aim.y[lane] < height_;
    if (inside && edge_[index(aim.x[lane], aim.y[lane])] == kNoEdge) active |= 1U << lane;
  }
  if (active == 0) return;
  SurfaceHits hits;
  trace(aim, active, hits);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if ((active >> lane & 1U) == 0U) continue;
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
  const auto like = [&](int px, int py) { return same_surface(index(px, py), triangle, hit); };
  if (like(x, y)) return;
  const Edge edge = edge_towards(index(x, y), triangle);
  edge_[index(x, y)] |= edge;
  const bool seen = (x > 0 && like(x - 1, y)) || (y > 0 && like(x, y - 1)) ||
                    (x + 1 < width_ && like(x + 1, y)) || (y + 1 < height_ && like(x, y + 1));
  if (seen || edge == kLeafEdge) return;
  constexpr int kReach = 3;
  for (int dy = -kReach; dy <= kReach; ++dy) {
    const int side = kReach - std::abs(dy);
    if (y + dy < 0 || y + dy >= height_) continue;
    for (int px = std::max(x - side, 0); px <= std::min(x + side, width_ - 1); ++px)
      edge_[index(px, y + dy)] |= kShapeEdge;
  }
}

// Leaves are seen by the thousand, each smaller than an edge is long: few samples will do.
constexpr int kLeafSamples = 4;
constexpr int kTile = 4;  // [px]

void ViewPass::refine_edges() {
  std::vector<std::size_t> sharp;
  std::vector<std::size_t> leaves;
  // Tile by tile: pixels that are refined together lie together.
  for (int y0 = 0; y0 < height_; y0 += kTile) {
    for (int x0 = 0; x0 < width_; x0 += kTile) {
      for (int y = y0; y < std::min(y0 + kTile, height_); ++y) {
        for (int x = x0; x < std::min(x0 + kTile, width_); ++x) {
          const std::size_t i = index(x, y);
          if (edge_[i] == kNoEdge) continue;
          (edge_[i] == kLeafEdge ? leaves : sharp).push_back(i);
        }
      }
    }
  }
  const auto refine_all = [this](const std::vector<std::size_t>& pixels, int samples) {
    const auto per_packet = static_cast<std::size_t>(kLanes / samples);
    for (std::size_t begin = 0; begin < pixels.size(); begin += per_packet)
      refine(std::span(pixels).subspan(begin, std::min(per_packet, pixels.size() - begin)),
             samples);
  };
  refine_all(sharp, samples_);
  refine_all(leaves, std::min(samples_, kLeafSamples));
}

// Whether the centre of a pixel shows a surface that looks like one at `depth_m`: the same material
// at about the same distance and slope. Leaves count as alike whatever their slope.
bool ViewPass::alike(const Pixel& pixel, const SurfaceRecord& surface, float depth_m) const {
  if (pixel.material != surface.material) return false;
  constexpr float kDepthShare = 0.03F;
  if (std::abs(pixel.depth_m - depth_m) > kDepthShare * depth_m) return false;
  constexpr float kLeastCosine = 0.95F;  // 18 degrees
  return pixel.foliage ||
         scene_.surfaces.record(pixel.triangle).normal.dot(surface.normal) > kLeastCosine;
}

// A pixel whose shade serves for a sample that hit `triangle`, (dx, dy) from the centre of `pixel`:
// one on the same triangle, or a neighbour on that side, or the pixel itself, if they look alike.
std::optional<std::size_t> ViewPass::shaded_nearby(std::size_t pixel, std::uint32_t triangle,
                                                   float depth_m,
                                                   const Eigen::Vector2f& offset) const {
  if (pixels_[pixel].triangle == triangle) return pixel;
  const int x = static_cast<int>(pixel) % width_;
  const int y = static_cast<int>(pixel) / width_;
  const int left = std::max(x - 1, 0);
  const int right = std::min(x + 1, width_ - 1);
  for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, height_ - 1); ++ny)
    for (int nx = left; nx <= right; ++nx)
      if (pixels_[index(nx, ny)].triangle == triangle) return index(nx, ny);
  if (triangle == kNoTriangle) return std::nullopt;
  const int side_x = offset.x() < 0.0F ? left : right;
  const int side_y = std::clamp(offset.y() < 0.0F ? y - 1 : y + 1, 0, height_ - 1);
  const bool across = std::abs(offset.x()) > std::abs(offset.y());
  const std::size_t nearer = across ? index(side_x, y) : index(x, side_y);
  const std::size_t farther = across ? index(x, side_y) : index(side_x, y);
  const SurfaceRecord& surface = scene_.surfaces.record(triangle);
  for (const std::size_t other : {nearer, farther, pixel})
    if (alike(pixels_[other], surface, depth_m)) return other;
  return std::nullopt;
}

void ViewPass::find_sources(std::span<const std::size_t> pixels, const Aim& aim,
                            const SurfaceHits& hits, Samples& samples) const {
  const auto per_pixel = static_cast<std::size_t>(samples.per_pixel);
  for (std::size_t lane = 0; lane < pixels.size() * per_pixel; ++lane) {
    const std::size_t pixel = pixels[lane / per_pixel];
    const LaneMask bit = 1U << lane;
    const auto nearby = shaded_nearby(pixel, hits.rays.hit.primID[lane], hits.rays.ray.tfar[lane],
                                      {aim.dx[lane], aim.dy[lane]});
    if (nearby) {
      samples.source[lane] = *nearby;
      if (pixels_[*nearby].dark) samples.dark |= bit;
      if ((edge_[pixel] & kShadowEdge) != 0) samples.ask_sun |= bit;
    } else {
      samples.fresh |= bit;
      samples.ask_sun |= bit;
    }
  }
  samples.ask_sun &= hits.surface;
}

// Replaces each pixel by the mean of its centre and its samples. A sample takes the shade of a
// pixel nearby on its triangle, or is shaded itself; at shadows' edges each sample asks for the sun
// itself.
void ViewPass::refine(std::span<const std::size_t> pixels, int samples_per_pixel) {
  const auto per_pixel = static_cast<std::size_t>(samples_per_pixel);
  Aim aim;
  LaneMask active = 0;
  for (std::size_t lane = 0; lane < pixels.size() * per_pixel; ++lane) {
    const int pixel = static_cast<int>(pixels[lane / per_pixel]);
    const Eigen::Vector2f offset = sample_offset(lane % per_pixel, per_pixel);
    aim.x[lane] = pixel % width_;
    aim.y[lane] = pixel / width_;
    aim.dx[lane] = offset.x();
    aim.dy[lane] = offset.y();
    active |= 1U << lane;
  }
  SurfaceHits hits;
  trace(aim, active, hits);
  Samples samples;
  samples.per_pixel = samples_per_pixel;
  find_sources(pixels, aim, hits, samples);
  SurfacePoints points;
  hits.surface &= samples.fresh | samples.ask_sun;
  locate(scene_.surfaces, hits, points);
  if (options_.shadows && scene_.lighting.sun > 0.0F)
    samples.dark = (samples.dark & ~samples.ask_sun) | shadowed(scene_, samples.ask_sun, points);
  average<float>(pixels, hits, points, samples, gray_, view_.radiance);
  average<Eigen::Vector3f>(pixels, hits, points, samples, color_, view_.rgb);
}

template <typename Value>
void ViewPass::average(std::span<const std::size_t> pixels, const SurfaceHits& hits,
                       const SurfacePoints& points, const Samples& samples,
                       const std::vector<Shade<Value>>& shaded, std::vector<Value>& image) const {
  if (image.empty()) return;
  std::array<Shade<Value>, kLanes> shades;
  shade(scene_, hits, points, samples.fresh, shades);
  const auto per_pixel = static_cast<std::size_t>(samples.per_pixel);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    Value sum = image[pixels[p]];
    for (std::size_t lane = p * per_pixel; lane < (p + 1) * per_pixel; ++lane) {
      const bool fresh = (samples.fresh >> lane & 1U) != 0U;
      sum += lit(fresh ? shades[lane] : shaded[samples.source[lane]],
                 (samples.dark >> lane & 1U) != 0U);
    }
    image[pixels[p]] = sum / static_cast<float>(samples.per_pixel + 1);
  }
}

}  // namespace km
