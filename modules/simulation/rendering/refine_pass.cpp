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

void ViewPass::find_sources(std::span<const Sample> batch, const SurfaceHits& hits,
                            Sources& sources) const {
  for (std::size_t lane = 0; lane < batch.size(); ++lane) {
    const LaneMask bit = 1U << lane;
    const auto nearby =
        shaded_nearby(batch[lane], hits.rays.hit.primID[lane], hits.rays.ray.tfar[lane]);
    if (nearby) {
      sources.pixel[lane] = *nearby;
      if (pixels_[*nearby].dark) sources.dark |= bit;
      if ((edge_[index(batch[lane].x, batch[lane].y)] & kShadow) != 0) sources.ask_sun |= bit;
    } else {
      sources.fresh |= bit;
      sources.ask_sun |= bit;
    }
  }
  sources.ask_sun &= hits.surface;
}

// A sample takes the shade of a pixel nearby, or is shaded itself; at shadows' edges each sample
// asks for the sun itself.
void ViewPass::refine(std::span<const Sample> batch) {
  Aim aim;
  for (std::size_t lane = 0; lane < batch.size(); ++lane)
    aim.set(lane, batch[lane].x, batch[lane].y, batch[lane].offset);
  SurfaceHits hits;
  trace(aim, hits);
  Sources sources;
  find_sources(batch, hits, sources);
  SurfacePoints points;
  hits.surface &= sources.fresh | sources.ask_sun;
  locate(scene_.surfaces, hits, points);
  if (options_.shadows && scene_.lighting.sun > 0.0F)
    sources.dark = (sources.dark & ~sources.ask_sun) | shadowed(scene_, sources.ask_sun, points);
  mix<float>(batch, hits, points, sources, gray_, view_.radiance);
  mix<Eigen::Vector3f>(batch, hits, points, sources, color_, view_.rgb);
}

template <typename Value>
void ViewPass::mix(std::span<const Sample> batch, const SurfaceHits& hits,
                   const SurfacePoints& points, const Sources& sources,
                   const std::vector<Shade<Value>>& shaded, std::vector<Value>& image) const {
  if (image.empty()) return;
  std::array<Shade<Value>, kLanes> shades;
  shade(scene_, hits, points, sources.fresh, shades);
  const float weight = 1.0F / static_cast<float>(samples_ + 1);
  for (std::size_t lane = 0; lane < batch.size(); ++lane) {
    const std::size_t pixel = index(batch[lane].x, batch[lane].y);
    const bool fresh = (sources.fresh >> lane & 1U) != 0U;
    const Value sample =
        lit(fresh ? shades[lane] : shaded[sources.pixel[lane]], (sources.dark >> lane & 1U) != 0U);
    image[pixel] += weight * (sample - lit(shaded[pixel], pixels_[pixel].dark));
  }
}

}  // namespace km
