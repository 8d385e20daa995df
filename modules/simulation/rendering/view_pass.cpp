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

LaneMask ViewPass::lanes_inside(const Aim& aim) const {
  LaneMask inside = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    if (aim.x[lane] < width_ && aim.y[lane] < height_) inside |= 1U << lane;
  return inside;
}

ViewPass::Aim ViewPass::aim_at_block(int x0, int y0) {
  Aim aim;
  for (int i = 0; i < kLanes; ++i) {
    const auto lane = static_cast<std::size_t>(i);
    aim.x[lane] = x0 + i % kBlock;
    aim.y[lane] = y0 + i / kBlock;
    aim.dx[lane] = 0.0F;
    aim.dy[lane] = 0.0F;
  }
  return aim;
}

void ViewPass::trace(const Aim& aim, LaneMask active, SurfaceHits& hits) const {
  const Eigen::Vector2f* bearings = rays_.bearings().data();
  const std::ptrdiff_t stride = rays_.stride();
  const Eigen::Vector3f x_axis = R_world_cam_.col(0);
  const Eigen::Vector3f y_axis = R_world_cam_.col(1);
  const Eigen::Vector3f z_axis = R_world_cam_.col(2);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if ((active >> lane & 1U) == 0U) continue;
    const Eigen::Vector2f* bearing = bearings + aim.y[lane] * stride + aim.x[lane];
    const Eigen::Vector2f right = bearing[1] - bearing[0];
    const Eigen::Vector2f down = bearing[stride] - bearing[0];
    const Eigen::Vector2f at = bearing[0] + aim.dx[lane] * right + aim.dy[lane] * down;
    set_ray(hits.rays, static_cast<int>(lane), origin_, at.x() * x_axis + at.y() * y_axis + z_axis,
            0.0F, std::numeric_limits<float>::infinity());
    hits.right_x[lane] = x_axis.x() * right.x() + y_axis.x() * right.y();
    hits.right_y[lane] = x_axis.y() * right.x() + y_axis.y() * right.y();
    hits.right_z[lane] = x_axis.z() * right.x() + y_axis.z() * right.y();
    hits.down_x[lane] = x_axis.x() * down.x() + y_axis.x() * down.y();
    hits.down_y[lane] = x_axis.y() * down.x() + y_axis.y() * down.y();
    hits.down_z[lane] = x_axis.z() * down.x() + y_axis.z() * down.y();
  }
  hits.active = active;
  scene_.tracer.intersect(active, RayKind::kCoherent, hits.rays);
  hits.surface = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    hits.surface |= static_cast<LaneMask>(hits.rays.hit.primID[lane] != kNoTriangle) << lane;
  hits.surface &= active;
}

void ViewPass::shade_block(int x0, int y0) {
  const Aim aim = aim_at_block(x0, y0);
  SurfaceHits hits;
  trace(aim, lanes_inside(aim), hits);
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
