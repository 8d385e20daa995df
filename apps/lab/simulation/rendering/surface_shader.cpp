#include "apps/lab/simulation/rendering/surface_shader.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace km {
namespace {

// Terms of a point's radiance:
// albedo * (sky + lamps) + mirrored_sky * sky(mirrored) + mirrored_rest + haze, and albedo * sun.
struct Mixture {
  Lanes sun, sky, lamps;
  Lanes mirrored_sky, mirrored_rest;
  Lanes haze;
  Lanes3 mirrored;  // direction
  bool any_mirror = false;
};

// exp(-x) for x >= 0, with relative error 2e-7. The library's result depends on the processor.
float exp_negative(float x) {
  constexpr float kLog2e = 1.44269504F;
  constexpr float kLn2 = 0.693147181F;
  constexpr float kHalfRoot = 0.707106781F;
  constexpr float kSmallest = 100.0F;  // largest negative exponent of two
  const float power = std::min(x * kLog2e, kSmallest);
  const auto whole = static_cast<std::int32_t>(power);
  const float z = (0.5F - (power - static_cast<float>(whole))) * kLn2;  // within 0.35 of zero
  const float series =
      1.0F +
      z * (1.0F + z * (0.5F + z * (1.0F / 6 + z * (1.0F / 24 + z * (1.0F / 120 + z / 720)))));
  return kHalfRoot * series * std::bit_cast<float>((127 - whole) << 23);
}

// Schlick's approximation, for a surface that mirrors `specular` seen head-on.
float mirrored_share(float specular, float cosine) {
  const float grazing = 1.0F - std::min(cosine, 1.0F);
  const float grazing2 = grazing * grazing;
  return specular +
         (1.0F - specular) * std::min(1.0F, 2.0F * specular) * grazing2 * grazing2 * grazing;
}

float dot(const Lanes3& a, const Eigen::Vector3f& b, std::size_t i) {
  return a.x[i] * b.x() + a.y[i] * b.y() + a.z[i] * b.z();
}

void add_lamps(const Lighting& lighting, const LightVolume::Light& light,
               const SurfacePoints& points, Lanes& sum) {
  for (std::size_t lamp = 0; lamp < lighting.lamps.size(); ++lamp) {
    const Eigen::Vector3f at = lighting.lamps[lamp].position;
    const float intensity = lighting.lamps[lamp].intensity;
    const Lanes& visibility = light.lamp_visibility[lamp];
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float x = at.x() - points.position.x[i];
      const float y = at.y() - points.position.y[i];
      const float z = at.z() - points.position.z[i];
      constexpr float kNearest_m2 = 0.1F;  // a lamp has a size
      const float distance2 = std::max(x * x + y * y + z * z, kNearest_m2);
      const float along = x * points.normal.x[i] + y * points.normal.y[i] + z * points.normal.z[i];
      sum[i] +=
          intensity * visibility[i] * std::max(0.0F, along) / (distance2 * std::sqrt(distance2));
    }
  }
}

// Sunlight on each side, before shadows; light passes through leaves and cloth from behind.
void set_sunlight(const Lighting& lighting, const SurfacePoints& points, const Lanes& transmission,
                  Lanes& sun) {
  const Eigen::Vector3f to_sun = lighting.to_sun;
  const float strength = lighting.sun;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float side = dot(points.plane_normal, to_sun, i);
    const float cosine = dot(points.normal, to_sun, i);
    const float through = -transmission[i];
    const float share = side > 0.0F ? 1.0F : through;
    sun[i] = strength * std::max(0.0F, share * cosine);
  }
}

// A glossy surface mirrors the part of the sky that the surroundings leave open in that direction.
void add_mirror(const RenderScene& scene, const SurfacePoints& points, const Lanes& specular,
                Mixture& mixture) {
  run_wide([&] {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float twice = 2.0F * dot(points.view, points.normal, i);
      mixture.mirrored.x[i] = points.view.x[i] - twice * points.normal.x[i];
      mixture.mirrored.y[i] = points.view.y[i] - twice * points.normal.y[i];
      mixture.mirrored.z[i] = points.view.z[i] - twice * points.normal.z[i];
    }
  });
  LightVolume::Light around;
  scene.light.look_up(points.position, mixture.mirrored, around);
  const float least_ambient = std::max(scene.lighting.ambient, 1e-6F);
  const bool outdoors = scene.lighting.sun > 0.0F;
  run_wide([&] {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float cosine = std::abs(dot(points.view, points.normal, i));
      const float share = specular[i] > 0.0F ? mirrored_share(specular[i], cosine) : 0.0F;
      const float open = std::min(1.0F, around.ambient[i] / least_ambient);
      const float height = std::min(std::max(10.0F * mixture.mirrored.z[i] + 0.5F, 0.0F), 1.0F);
      const float up = outdoors ? height : 0.0F;
      mixture.mirrored_sky[i] = share * up * open;
      mixture.mirrored_rest[i] = share * (1.0F - up) * around.ambient[i];
      mixture.sun[i] *= 1.0F - share;
      mixture.sky[i] *= 1.0F - share;
      mixture.lamps[i] *= 1.0F - share;
    }
  });
}

void add_haze(float distance_scale_m, const SurfacePoints& points, Mixture& mixture) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float clear = exp_negative(points.distance_m[i] / distance_scale_m);
    mixture.sun[i] *= clear;
    mixture.sky[i] *= clear;
    mixture.lamps[i] *= clear;
    mixture.mirrored_sky[i] *= clear;
    mixture.mirrored_rest[i] *= clear;
    mixture.haze[i] = 1.0F - clear;
  }
}

Mixture mixture_of(const RenderScene& scene, const SurfacePoints& points) {
  Lanes transmission;
  Lanes specular;
  Mixture mixture;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const ShadingMaterial& material = *points.material[i];
    transmission[i] = material.transmission;
    specular[i] = material.specular;
    mixture.any_mirror = mixture.any_mirror || material.specular > 0.0F;
    mixture.lamps[i] = material.glow;
  }
  LightVolume::Light light;
  scene.light.look_up(points.position, points.normal, light);
  mixture.sky = light.ambient;
  mixture.mirrored_sky.fill(0.0F);
  mixture.mirrored_rest.fill(0.0F);
  mixture.haze.fill(0.0F);
  run_wide([&] {
    set_sunlight(scene.lighting, points, transmission, mixture.sun);
    add_lamps(scene.lighting, light, points, mixture.lamps);
  });
  if (mixture.any_mirror) add_mirror(scene, points, specular, mixture);
  if (scene.lighting.haze_distance_m > 0.0F)
    run_wide([&] { add_haze(scene.lighting.haze_distance_m, points, mixture); });
  return mixture;
}

void shade_surfaces(const RenderScene& scene, const SurfacePoints& points, const Mixture& mixture,
                    Shades& shades) {
  const Lanes albedo = gray_albedo(points, taps_of(points));
  Lanes mirrored{};
  if (mixture.any_mirror) mirrored = scene.sky.luminance(mixture.mirrored);
  const float haze = scene.sky.haze_luminance();
  run_wide([&] {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float ambient = albedo[i] * (mixture.sky[i] + mixture.lamps[i]) +
                            mixture.mirrored_sky[i] * mirrored[i] + mixture.mirrored_rest[i] +
                            mixture.haze[i] * haze;
      shades[i] = {ambient, albedo[i] * mixture.sun[i]};
    }
  });
}

Lanes3 directions_of(const RayPacket& rays) {
  Lanes3 directions;
  std::copy_n(rays.ray.dir_x, kLanes, directions.x.begin());
  std::copy_n(rays.ray.dir_y, kLanes, directions.y.begin());
  std::copy_n(rays.ray.dir_z, kLanes, directions.z.begin());
  return directions;
}

}  // namespace

RenderScene::RenderScene(const World& world)
    : lighting(world.lighting),
      surfaces(world),
      tracer(world.mesh),
      sky(world.lighting),
      light(world, tracer, surfaces, sky) {}

void SceneView::intersect(LaneMask active, RayPacket& rays) const {
  fixed.tracer.intersect(active, rays);
  if (moved == nullptr) return;
  RayPacket nearer = rays;  // a ray ends at its hit of a fixed surface
  moved->tracer().intersect(active, nearer);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!has_lane(active, lane) || nearer.hit.primID[lane] == kNoTriangle) continue;
    rays.hit.primID[lane] = fixed.surfaces.size() + nearer.hit.primID[lane];
    rays.hit.u[lane] = nearer.hit.u[lane];
    rays.hit.v[lane] = nearer.hit.v[lane];
    rays.ray.tfar[lane] = nearer.ray.tfar[lane];
  }
}

LaneMask SceneView::occluded(LaneMask active, RayPacket& rays) const {
  if (moved == nullptr) return fixed.tracer.occluded(active, rays);
  RayPacket same = rays;  // hits end rays
  const LaneMask dark = fixed.tracer.occluded(active, rays);
  return dark | moved->tracer().occluded(active & ~dark, same);
}

LaneMask shadowed(const SceneView& scene, LaneMask wanted, const SurfacePoints& points) {
  if (wanted == 0) return 0;
  const Eigen::Vector3f to_sun = scene.fixed.lighting.to_sun;
  RayPacket rays;
  Lanes facing;
  run_wide([&] {
    for (std::size_t i = 0; i < kLanes; ++i) {
      facing[i] = dot(points.plane_normal, to_sun, i);
      constexpr float kLift_m = 0.002F;
      const float lift = facing[i] > 0.0F ? kLift_m : -kLift_m;
      rays.ray.org_x[i] = points.position.x[i] + lift * points.plane_normal.x[i];
      rays.ray.org_y[i] = points.position.y[i] + lift * points.plane_normal.y[i];
      rays.ray.org_z[i] = points.position.z[i] + lift * points.plane_normal.z[i];
      rays.ray.dir_x[i] = to_sun.x();
      rays.ray.dir_y[i] = to_sun.y();
      rays.ray.dir_z[i] = to_sun.z();
      rays.ray.tnear[i] = 0.0F;
      rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
    }
  });
  LaneMask dark = 0;
  for (std::size_t i = 0; i < kLanes; ++i)
    if (facing[i] <= 0.0F && !(points.material[i]->transmission > 0.0F)) dark |= 1U << i;
  return (dark & wanted) | scene.occluded(wanted & ~dark, rays);
}

void shade(const RenderScene& scene, const SurfaceHits& hits, const SurfacePoints& points,
           LaneMask wanted, Shades& shades) {
  if ((wanted & hits.surface) != 0)
    shade_surfaces(scene, points, mixture_of(scene, points), shades);
  const LaneMask sky = wanted & ~hits.surface;
  if (sky == 0) return;
  const Lanes radiance = scene.sky.luminance(directions_of(hits.rays));
  for (std::size_t i = 0; i < kLanes; ++i)
    if (has_lane(sky, i)) shades[i] = {radiance[i], 0.0F};
}

}  // namespace km
