#include <algorithm>
#include <cmath>

#include "modules/simulation/rendering/sample_pattern.hpp"
#include "modules/simulation/rendering/view_pass.hpp"

namespace km {
namespace {

template <typename Value>
Value lit(const Shade<Value>& shade, bool dark) {
  return dark ? shade.ambient : Value(shade.ambient + shade.sun);
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

}  // namespace

// Whether a sample on this side of a pixel's centre may see what the pixel's edges are with.
bool ViewPass::beyond_edge(std::uint8_t edge, const Eigen::Vector2f& offset) {
  const int across = offset.x() < 0.0F ? kLeft : kRight;
  const int along = offset.y() < 0.0F ? kUp : kDown;
  return (edge & (kInside | across | along)) != 0;
}

// Makes each pixel with an edge the mean of its centre and its samples; those that lie away from
// the edge look like the centre.
void ViewPass::refine_edges() {
  std::vector<Sample> batch;
  batch.reserve(kLanes);
  const auto n = static_cast<std::size_t>(samples_);
  const auto refine_pixel = [&](int x, int y) {
    const std::uint8_t edge = edge_[index(x, y)];
    if (edge == kNoEdge) return;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2f offset = sample_offset(i, n);
      if (!beyond_edge(edge, offset)) continue;
      batch.push_back({x, y, offset});
      if (batch.size() < kLanes) continue;
      refine(batch);
      batch.clear();
    }
  };
  // Tile by tile: samples that are traced together lie together.
  constexpr int kTile = 4;
  for (int y0 = 0; y0 < height_; y0 += kTile)
    for (int x0 = 0; x0 < width_; x0 += kTile)
      for (int y = y0; y < std::min(y0 + kTile, height_); ++y)
        for (int x = x0; x < std::min(x0 + kTile, width_); ++x) refine_pixel(x, y);
  refine(batch);
  light_deferred();
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

// A pixel whose shade serves for a sample that hit `triangle`: its own or the neighbours on that
// side, if one shows the same triangle or at least looks alike.
std::optional<std::size_t> ViewPass::shaded_nearby(const Sample& sample, std::uint32_t triangle,
                                                   float depth_m) const {
  const std::size_t pixel = index(sample.x, sample.y);
  if (pixels_[pixel].triangle == triangle) return pixel;
  const int side_x = std::clamp(sample.x + (sample.offset.x() < 0.0F ? -1 : 1), 0, width_ - 1);
  const int side_y = std::clamp(sample.y + (sample.offset.y() < 0.0F ? -1 : 1), 0, height_ - 1);
  const bool across = std::abs(sample.offset.x()) > std::abs(sample.offset.y());
  const std::size_t nearer = across ? index(side_x, sample.y) : index(sample.x, side_y);
  const std::size_t farther = across ? index(sample.x, side_y) : index(side_x, sample.y);
  for (const std::size_t other : {nearer, farther, index(side_x, side_y)})
    if (pixels_[other].triangle == triangle) return other;
  if (triangle == kNoTriangle) return std::nullopt;
  const SurfaceRecord& surface = scene_.surfaces.record(triangle);
  for (const std::size_t other : {nearer, farther, pixel})
    if (alike(pixels_[other], surface, depth_m)) return other;
  return std::nullopt;
}

// A sample takes the shade of a pixel nearby, or is shaded itself, later, together with others; at
// shadows' edges each sample asks for the sun itself.
void ViewPass::refine(std::span<const Sample> batch) {
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
      const bool dark = pixels_[*source].dark;
      if (request_.radiance) add_sample(pixel, lit(gray_[*source], dark), gray_, view_.radiance);
      if (request_.rgb) add_sample(pixel, lit(color_[*source], dark), color_, view_.rgb);
    }
  }
}

// Puts a sample whose light is not known yet into the packet of those that are lit together.
void ViewPass::defer(const SurfaceHits& hits, std::size_t lane, std::size_t pixel,
                     std::optional<std::size_t> source) {
  const std::size_t to = deferred_.count++;
  const LaneMask bit = 1U << to;
  copy_lane(hits, lane, deferred_.hits, to);
  deferred_.pixel[to] = pixel;
  deferred_.source[to] = source.value_or(pixel);
  if (!source) deferred_.fresh |= bit;
  if (deferred_.count == kLanes) light_deferred();
}

void ViewPass::light_deferred() {
  const SurfaceHits& hits = deferred_.hits;
  SurfacePoints points;
  locate(scene_.surfaces, hits, points);
  LaneMask dark = 0;
  if (options_.shadows && scene_.lighting.sun > 0.0F) dark = shadowed(scene_, hits.surface, points);
  if (request_.radiance) mix(points, dark, gray_, view_.radiance);
  if (request_.rgb) mix(points, dark, color_, view_.rgb);
  deferred_ = {};
}

template <typename Value>
void ViewPass::mix(const SurfacePoints& points, LaneMask dark,
                   const std::vector<Shade<Value>>& shaded, std::vector<Value>& image) const {
  std::array<Shade<Value>, kLanes> shades;
  shade(scene_, deferred_.hits, points, deferred_.fresh, shades);
  for (std::size_t i = 0; i < deferred_.count; ++i) {
    const Shade<Value>& light =
        has_lane(deferred_.fresh, i) ? shades[i] : shaded[deferred_.source[i]];
    add_sample(deferred_.pixel[i], lit(light, has_lane(dark, i)), shaded, image);
  }
}

// In the mean of a pixel's centre and samples, those not added count as the centre.
template <typename Value>
void ViewPass::add_sample(std::size_t pixel, const Value& radiance,
                          const std::vector<Shade<Value>>& shaded,
                          std::vector<Value>& image) const {
  const float weight = 1.0F / static_cast<float>(samples_ + 1);
  image[pixel] += weight * (radiance - lit(shaded[pixel], pixels_[pixel].dark));
}

}  // namespace km
