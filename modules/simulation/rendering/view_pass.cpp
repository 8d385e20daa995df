#include "modules/simulation/rendering/view_pass.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace km {
namespace {

constexpr int kBlock = 4;  // a packet covers 4 x 4 pixels
static_assert(kBlock * kBlock == kLanes);

int usable_samples(int wanted) {
  const int rounded = static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(wanted, 1))));
  return std::min(rounded, kLanes);
}

}  // namespace

ViewPass::ViewPass(const RenderScene& scene, const RenderOptions& options, const PixelRays& rays,
                   const SE3& T_world_body, const RenderRequest& request)
    : scene_(scene),
      options_(options),
      rays_(rays),
      request_(request),
      width_(rays.camera().width),
      height_(rays.camera().height),
      samples_(usable_samples(options.samples_per_pixel)) {
  const SE3 T_world_cam = T_world_body * rays.camera().T_body_cam;
  R_world_cam_ = T_world_cam.linear().cast<float>();
  origin_ = T_world_cam.translation().cast<float>();
  view_.width = width_;
  view_.height = height_;
  const std::size_t n = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  pixels_.resize(n);
  if (request.radiance) gray_.resize(n);
  if (request.rgb) color_.resize(n);
  if (request.radiance) view_.radiance.resize(n);
  if (request.rgb) view_.rgb.resize(n);
  if (request.depth) view_.depth_m.resize(n);
  if (request.labels) view_.labels.resize(n);
}

RenderedView ViewPass::run() {
  for (int y = 0; y < height_; y += kBlock)
    for (int x = 0; x < width_; x += kBlock) shade_block(x, y);
  const bool shaded = request_.radiance || request_.rgb;
  if (shaded && samples_ > 1) {
    edge_.assign(pixels_.size(), kNoEdge);
    compare_neighbours();
    for (int y = 0; y < height_; y += kBlock)
      for (int x = 0; x < width_; x += 2 * kBlock) find_thin_things(x, y);
    refine_edges();
  }
  return std::move(view_);
}

void ViewPass::trace(const Aim& aim, SurfaceHits& hits) const {
  // Bearing of each pixel, and its change to the right and down. Lanes that are not active repeat
  // some pixel: without branches the loops run several lanes at a time.
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
    const float a = R_world_cam_(row, 0);
    const float b = R_world_cam_(row, 1);
    const float c = R_world_cam_(row, 2);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      direction[lane] = a * x[lane] + b * y[lane] + c;
      right[lane] = a * right_x[lane] + b * right_y[lane];
      down[lane] = a * down_x[lane] + b * down_y[lane];
      origin[lane] = origin_[row];
    }
  };
  rotate(0, hits.rays.ray.dir_x, hits.right.x, hits.down.x, hits.rays.ray.org_x);
  rotate(1, hits.rays.ray.dir_y, hits.right.y, hits.down.y, hits.rays.ray.org_y);
  rotate(2, hits.rays.ray.dir_z, hits.right.z, hits.down.z, hits.rays.ray.org_z);
  std::fill_n(hits.rays.ray.tnear, kLanes, 0.0F);
  std::fill_n(hits.rays.ray.tfar, kLanes, std::numeric_limits<float>::infinity());

  hits.active = aim.active;
  scene_.tracer.intersect(aim.active, RayKind::kCoherent, hits.rays);
  hits.surface = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    hits.surface |= static_cast<LaneMask>(hits.rays.hit.primID[lane] != kNoTriangle) << lane;
  hits.surface &= aim.active;
}

void ViewPass::shade_block(int x0, int y0) {
  Aim aim;
  for (int y = y0; y < std::min(y0 + kBlock, height_); ++y)
    for (int x = x0; x < std::min(x0 + kBlock, width_); ++x)
      aim.set(static_cast<std::size_t>((y - y0) * kBlock + x - x0), x, y, {0.0F, 0.0F});
  SurfaceHits hits;
  trace(aim, hits);
  SurfacePoints points;
  LaneMask dark = 0;
  if (request_.radiance || request_.rgb) {
    locate(scene_.surfaces, hits, points);
    if (options_.shadows && scene_.lighting.sun > 0.0F)
      dark = shadowed(scene_, hits.surface, points);
  }
  store_block(aim, hits, points, dark);
}

void ViewPass::store_block(const Aim& aim, const SurfaceHits& hits, const SurfacePoints& points,
                           LaneMask dark) {
  std::array<Shade<float>, kLanes> gray;
  std::array<Shade<Eigen::Vector3f>, kLanes> color;
  if (request_.radiance) shade(scene_, hits, points, hits.active, gray);
  if (request_.rgb) shade(scene_, hits, points, hits.active, color);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if ((hits.active >> lane & 1U) == 0U) continue;
    const std::size_t i = index(aim.x[lane], aim.y[lane]);
    const bool surface = (hits.surface >> lane & 1U) != 0U;
    const float depth_m = surface ? hits.rays.ray.tfar[lane] : 0.0F;
    const bool is_dark = (dark >> lane & 1U) != 0U;
    pixels_[i] = {hits.rays.hit.primID[lane], depth_m, kSkyMaterial, false, is_dark};
    if (surface) {
      const SurfaceRecord& record = scene_.surfaces.record(pixels_[i].triangle);
      pixels_[i].material = record.material;
      pixels_[i].foliage = scene_.surfaces.material(record).foliage;
    }
    if (request_.radiance) {
      gray_[i] = gray[lane];
      view_.radiance[i] = gray[lane].ambient + (is_dark ? 0.0F : gray[lane].sun);
    }
    if (request_.rgb) {
      color_[i] = color[lane];
      view_.rgb[i] = color[lane].ambient + (is_dark ? 0.0F : 1.0F) * color[lane].sun;
    }
    if (request_.depth) view_.depth_m[i] = depth_m;
    if (request_.labels)
      view_.labels[i] =
          surface ? scene_.surfaces.material(scene_.surfaces.record(pixels_[i].triangle)).label
                  : static_cast<LabelId>(SurfaceClass::kSky);
  }
}

}  // namespace km
