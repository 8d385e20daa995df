#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "modules/simulation/rendering/luminance.hpp"
#include "modules/simulation/rendering/sample_pattern.hpp"
#include "modules/simulation/rendering/view_pass.hpp"

namespace km {

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

// Whether the radiances of two pixels differ by so much that a mean of them is seen as such.
bool ViewPass::contrast(std::size_t a, std::size_t b) const {
  constexpr float kVisible = 0.05F;  // steps of some grey levels; the lens blurs them away
  const float at_a = request_.radiance ? view_.radiance[a] : luminance_of(view_.rgb[a]);
  const float at_b = request_.radiance ? view_.radiance[b] : luminance_of(view_.rgb[b]);
  return std::abs(at_a - at_b) > kVisible * std::max(at_a, at_b);
}

// Edges towards each other of two neighbouring pixels.
void ViewPass::compare(std::size_t a, Edge towards_b, std::size_t b, Edge towards_a) {
  const bool one_triangle = pixels_[a].triangle == pixels_[b].triangle;
  const bool one_light = pixels_[a].dark == pixels_[b].dark;
  if ((one_triangle && one_light) || !contrast(a, b)) return;
  const bool one_surface = one_triangle || same_surface(a, pixels_[b].triangle, position(b));
  if (one_surface && one_light) return;
  const Edge kind = one_surface ? kShadow : kNoEdge;
  edge_[a] |= static_cast<std::uint8_t>(towards_b | kind);
  edge_[b] |= static_cast<std::uint8_t>(towards_a | kind);
}

void ViewPass::compare_neighbours() {
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (x + 1 < width_) compare(index(x, y), kRight, index(x + 1, y), kLeft);
      if (y + 1 < height_) compare(index(x, y), kDown, index(x, y + 1), kUp);
    }
  }
}

// Poles and wires narrower than a pixel can pass between all centres of a row or column. One more
// ray in every other pixel of 8 x 4, elsewhere in each, finds most of them. Where an edge is known
// already there is no need.
void ViewPass::find_thin_things(int x0, int y0) {
  // In front of what is nearer than this, nothing is narrower than a pixel.
  constexpr float kThinnest_m = 0.02F;
  const float nearest_m = kThinnest_m * static_cast<float>(rays_.camera().fx);
  Aim aim;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const int row = static_cast<int>(lane) / 4;
    const int x = x0 + 2 * (static_cast<int>(lane) % 4) + row % 2;
    const int y = y0 + row;
    if (x >= width_ || y >= height_ || edge_[index(x, y)] != kNoEdge) continue;
    const float depth_m = pixels_[index(x, y)].depth_m;
    if (depth_m > 0.0F && depth_m < nearest_m) continue;
    aim.set(lane, x, y, sample_offset((5 * lane + 3) % kLanes, kLanes));
  }
  if (aim.active == 0) return;
  SurfaceHits hits;
  trace(aim, hits);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if ((aim.active >> lane & 1U) == 0U) continue;
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
// neighbour shows that surface either, it is thin, and likely runs on unseen beside the pixel;
// leaves do not.
void ViewPass::flag_unlike(int x, int y, std::uint32_t triangle, const Eigen::Vector3f& hit) {
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

}  // namespace km
