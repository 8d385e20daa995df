#include "modules/simulation/rendering/surface_shader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace km {
namespace {

Eigen::Vector3f direction_of(const RayPacket& rays, int lane) {
  return {rays.ray.dir_x[lane], rays.ray.dir_y[lane], rays.ray.dir_z[lane]};
}

// Semi-axes of the ellipse that the unit circle of the pixel becomes in texture coordinates: J maps
// a step in the image to one on the texture, and J J^T has them as its eigenvectors.
struct Footprint {
  float major_u = 0.0F, major_v = 0.0F, major_m = 0.0F, minor_m = 0.0F;
};

Footprint footprint_of(float u_x, float u_y, float v_x, float v_y) {
  const float a = u_x * u_x + u_y * u_y;
  const float b = u_x * v_x + u_y * v_y;
  const float c = v_x * v_x + v_y * v_y;
  const float half = 0.5F * (a - c);
  const float largest = 0.5F * (a + c) + std::sqrt(half * half + b * b);
  // Two forms of the eigenvector; the longer one is the safe one.
  const float eu = half > 0.0F ? largest - c : b;
  const float ev = half > 0.0F ? b : largest - a;
  const float length = std::sqrt(eu * eu + ev * ev);
  constexpr float kMost_m = 1e4F;  // at the horizon
  Footprint result;
  result.major_m = std::min(std::sqrt(largest), kMost_m);
  result.minor_m = result.major_m > 0.0F
                       ? std::min(std::abs(u_x * v_y - u_y * v_x) / result.major_m, result.major_m)
                       : 0.0F;
  const float scale = length > 0.0F ? result.major_m / length : 0.0F;
  result.major_u = scale * eu;
  result.major_v = scale * ev;
  return result;
}

// A texture averaged over the footprint: a few round samples side by side along its longer axis.
struct Taps {
  Eigen::Vector2f first, step;  // [m]
  int count = 1;
  float width_m = 0.0F;
};

Taps taps_of(const SurfacePoints& points, std::size_t lane) {
  constexpr float kMostTaps = 4.0F;
  const float ratio = points.major_m[lane] / std::max(points.minor_m[lane], 1e-9F);
  Taps taps;
  taps.count = static_cast<int>(std::clamp(ratio + 0.5F, 1.0F, kMostTaps));
  const auto n = static_cast<float>(taps.count);
  taps.width_m = std::max(points.minor_m[lane], points.major_m[lane] / n);
  taps.step = Eigen::Vector2f(points.major_u[lane], points.major_v[lane]) / n;
  taps.first = Eigen::Vector2f(points.u[lane], points.v[lane]) - (0.5F * (n - 1.0F)) * taps.step;
  return taps;
}

template <typename Value>
struct Channels;

template <>
struct Channels<float> {
  static float texel(const Texture& texture, const Eigen::Vector2f& uv, float width) {
    return texture.luminance(uv, width);
  }
  static float product(float a, float b) { return a * b; }
  static float zero() { return 0.0F; }
  static float one() { return 1.0F; }
  static float tint(const ShadingMaterial& material) { return material.tint_luminance; }
  static float sky(const Sky& sky, const Eigen::Vector3f& d) { return sky.luminance(d); }
  static float haze(const Sky& sky) { return sky.haze_luminance(); }
  static float sunlight() { return 1.0F; }
  static float skylight() { return 1.0F; }
};

template <>
struct Channels<Eigen::Vector3f> {
  static Eigen::Vector3f texel(const Texture& texture, const Eigen::Vector2f& uv, float width) {
    return texture.color(uv, width);
  }
  static Eigen::Vector3f product(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    return a.cwiseProduct(b);
  }
  static Eigen::Vector3f zero() { return Eigen::Vector3f::Zero(); }
  static Eigen::Vector3f one() { return Eigen::Vector3f::Ones(); }
  static Eigen::Vector3f tint(const ShadingMaterial& material) { return material.tint; }
  static Eigen::Vector3f sky(const Sky& sky, const Eigen::Vector3f& d) { return sky.color(d); }
  static Eigen::Vector3f haze(const Sky& sky) { return sky.haze_color(); }
  // A warm sun and a blue sky; both of luminance 1.
  static Eigen::Vector3f sunlight() { return {1.06F, 0.995F, 0.87F}; }
  static Eigen::Vector3f skylight() { return {0.93F, 1.0F, 1.2F}; }
};

template <typename Value>
Value albedo(const ShadingMaterial& material, const Taps& taps) {
  using C = Channels<Value>;
  Value base = C::zero();
  Value detail = C::zero();
  // Where a sample covers a whole tile of the detail, nothing of it is left.
  const float detail_width = taps.width_m * material.detail_per_m;
  const bool detailed = detail_width < 1.0F;
  Eigen::Vector2f uv = taps.first;
  for (int i = 0; i < taps.count; ++i, uv += taps.step) {
    base += C::texel(*material.base, uv * material.base_per_m, taps.width_m * material.base_per_m);
    if (detailed) detail += C::texel(*material.detail, uv * material.detail_per_m, detail_width);
  }
  const auto n = static_cast<float>(taps.count);
  const Value factor = detailed ? Value((2.0F / n) * detail) : C::one();
  return C::product(C::tint(material), C::product((1.0F / n) * base, factor));
}

float lamp_light(const Lighting& lighting, const LightVolume::Light& light,
                 const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
  float sum = 0.0F;
  for (std::size_t i = 0; i < lighting.lamps.size(); ++i) {
    const Eigen::Vector3f to_lamp = lighting.lamps[i].position - point;
    constexpr float kNearest_m2 = 0.1F;  // a lamp has a size
    const float distance2 = std::max(to_lamp.squaredNorm(), kNearest_m2);
    const float cosine = std::max(0.0F, normal.dot(to_lamp)) / std::sqrt(distance2);
    sum += lighting.lamps[i].intensity * light.lamp_visibility[i] * cosine / distance2;
  }
  return sum;
}

// What a glossy surface mirrors: the sky, as far as the surroundings leave it open that way.
template <typename Value>
Value mirrored(const RenderScene& scene, const Eigen::Vector3f& point,
               const Eigen::Vector3f& direction, const Eigen::Vector3f& normal) {
  using C = Channels<Value>;
  const Eigen::Vector3f d = direction - 2.0F * direction.dot(normal) * normal;
  const float around = scene.light.at(point, d).ambient;
  if (!(scene.lighting.sun > 0.0F)) return around * C::one();
  const float open = std::min(1.0F, around / std::max(scene.lighting.ambient, 1e-6F));
  const float up = std::clamp(10.0F * d.z() + 0.5F, 0.0F, 1.0F);
  return (up * open) * C::sky(scene.sky, d) + ((1.0F - up) * around) * C::one();
}

// Schlick's approximation, for a surface that mirrors `specular` seen head-on.
float mirrored_share(float specular, float cosine) {
  const float grazing = 1.0F - std::min(cosine, 1.0F);
  const float grazing2 = grazing * grazing;
  return specular +
         (1.0F - specular) * std::min(1.0F, 2.0F * specular) * grazing2 * grazing2 * grazing;
}

template <typename Value>
Shade<Value> shade_surface(const RenderScene& scene, const SurfacePoints& points, std::size_t lane,
                           const Eigen::Vector3f& view, float distance_m) {
  using C = Channels<Value>;
  const ShadingMaterial& material = *points.material[lane];
  const Eigen::Vector3f& point = points.position[lane];
  const Eigen::Vector3f& normal = points.normal[lane];
  const Value surface = albedo<Value>(material, taps_of(points, lane));
  const LightVolume::Light light = scene.light.at(point, normal);
  const float sun_side = points.plane_normal[lane].dot(scene.lighting.to_sun);
  const float cosine = normal.dot(scene.lighting.to_sun);
  const float facing =
      sun_side > 0.0F ? std::max(0.0F, cosine) : material.transmission * std::max(0.0F, -cosine);
  Shade<Value> result;
  result.sun = (scene.lighting.sun * facing) * C::product(surface, C::sunlight());
  result.ambient = light.ambient * C::product(surface, C::skylight()) +
                   (lamp_light(scene.lighting, light, point, normal) + material.glow) * surface;
  if (material.specular > 0.0F) {
    const float share = mirrored_share(material.specular, std::abs(view.dot(normal)));
    result.ambient =
        (1.0F - share) * result.ambient + share * mirrored<Value>(scene, point, view, normal);
    result.sun *= 1.0F - share;
  }
  if (scene.lighting.haze_distance_m > 0.0F) {
    const float clear = std::exp(-distance_m / scene.lighting.haze_distance_m);
    result.ambient = clear * result.ambient + (1.0F - clear) * C::haze(scene.sky);
    result.sun *= clear;
  }
  return result;
}

}  // namespace

RenderScene::RenderScene(const World& world)
    : lighting(world.lighting),
      surfaces(world),
      tracer(world.mesh),
      sky(world.lighting),
      light(world, tracer, surfaces, sky) {}

void locate(const SurfaceTable& surfaces, const SurfaceHits& hits, SurfacePoints& points) {
  const RayPacket& rays = hits.rays;
  for (int i = 0; i < kLanes; ++i) {
    if ((hits.surface >> i & 1U) == 0U) continue;
    const auto lane = static_cast<std::size_t>(i);
    const std::uint32_t triangle = rays.hit.primID[i];
    const SurfaceRecord& surface = surfaces.record(triangle);
    const Eigen::Vector3f d = direction_of(rays, i);
    const Eigen::Vector3f origin(rays.ray.org_x[i], rays.ray.org_y[i], rays.ray.org_z[i]);
    const float t = rays.ray.tfar[i];
    const Eigen::Vector3f p = origin + t * d;
    points.position[lane] = p;
    points.material[lane] = &surfaces.material(surface);
    const float along = surface.normal.dot(d);
    const float side = along > 0.0F ? -1.0F : 1.0F;
    points.plane_normal[lane] = side * surface.normal;
    points.normal[lane] =
        surface.smooth
            ? Eigen::Vector3f(side * surfaces.normal(triangle, rays.hit.u[i], rays.hit.v[i]))
            : points.plane_normal[lane];
    points.u[lane] = surface.u_gradient.dot(p) + surface.u_offset;
    points.v[lane] = surface.v_gradient.dot(p) + surface.v_offset;
    // The hit moves with the direction d as t * (dd - d * (n . dd) / (n . d)).
    const Eigen::Vector3f right(hits.right_x[lane], hits.right_y[lane], hits.right_z[lane]);
    const Eigen::Vector3f down(hits.down_x[lane], hits.down_y[lane], hits.down_z[lane]);
    const float slope_right = surface.normal.dot(right) / along;
    const float slope_down = surface.normal.dot(down) / along;
    const float u_along = surface.u_gradient.dot(d);
    const float v_along = surface.v_gradient.dot(d);
    const Footprint footprint =
        footprint_of(t * (surface.u_gradient.dot(right) - slope_right * u_along),
                     t * (surface.u_gradient.dot(down) - slope_down * u_along),
                     t * (surface.v_gradient.dot(right) - slope_right * v_along),
                     t * (surface.v_gradient.dot(down) - slope_down * v_along));
    points.major_u[lane] = footprint.major_u;
    points.major_v[lane] = footprint.major_v;
    points.major_m[lane] = footprint.major_m;
    points.minor_m[lane] = footprint.minor_m;
  }
}

LaneMask shadowed(const RenderScene& scene, LaneMask wanted, const SurfacePoints& points) {
  const Eigen::Vector3f& to_sun = scene.lighting.to_sun;
  RayPacket rays;
  LaneMask dark = 0;
  LaneMask cast = 0;
  for (int i = 0; i < kLanes; ++i) {
    if ((wanted >> i & 1U) == 0U) continue;
    const auto lane = static_cast<std::size_t>(i);
    const float facing = points.plane_normal[lane].dot(to_sun);
    if (facing <= 0.0F && !(points.material[lane]->transmission > 0.0F)) {
      dark |= 1U << i;
      continue;
    }
    cast |= 1U << i;
    constexpr float kLift_m = 0.002F;
    const float lift = facing > 0.0F ? kLift_m : -kLift_m;
    set_ray(rays, i, points.position[lane] + lift * points.plane_normal[lane], to_sun, 0.0F,
            std::numeric_limits<float>::infinity());
  }
  return dark | scene.tracer.occluded(cast, RayKind::kCoherent, rays);
}

template <typename Value>
void shade(const RenderScene& scene, const SurfaceHits& hits, const SurfacePoints& points,
           LaneMask wanted, std::array<Shade<Value>, kLanes>& shades) {
  using C = Channels<Value>;
  for (int i = 0; i < kLanes; ++i) {
    if ((wanted >> i & 1U) == 0U) continue;
    const auto lane = static_cast<std::size_t>(i);
    const Eigen::Vector3f d = direction_of(hits.rays, i);
    if ((hits.surface >> i & 1U) == 0U) {
      shades[lane] = {C::sky(scene.sky, d), C::zero()};
      continue;
    }
    const float length = d.norm();
    shades[lane] =
        shade_surface<Value>(scene, points, lane, d / length, length * hits.rays.ray.tfar[i]);
  }
}

template void shade<float>(const RenderScene&, const SurfaceHits&, const SurfacePoints&, LaneMask,
                           std::array<Shade<float>, kLanes>&);
template void shade<Eigen::Vector3f>(const RenderScene&, const SurfaceHits&, const SurfacePoints&,
                                     LaneMask, std::array<Shade<Eigen::Vector3f>, kLanes>&);

}  // namespace km
