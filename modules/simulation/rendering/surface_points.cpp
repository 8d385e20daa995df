#include "modules/simulation/rendering/surface_points.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace km {
namespace {

// What locate() computes from, side by side.
struct Gathered {
  Lanes3 origin, direction, right, down;
  Lanes t;
  Lanes3 plane_normal, normal;  // the latter not of unit length
  Lanes3 u_gradient, v_gradient;
  Lanes u_offset, v_offset;
};

Lanes lanes_of(const float* values) {
  Lanes lanes;
  std::copy_n(values, kLanes, lanes.begin());
  return lanes;
}

void copy_lane(Lanes3& lanes, std::size_t from, std::size_t to) {
  lanes.set(to, lanes.at(from));
}

// Lanes without a surface take all from the first that has one.
Gathered gather(const SurfaceTable& surfaces, const SurfaceHits& hits, SurfacePoints& points) {
  const RTCRay16& ray = hits.rays.ray;
  const RTCHit16& hit = hits.rays.hit;
  Gathered g;
  g.origin = {lanes_of(ray.org_x), lanes_of(ray.org_y), lanes_of(ray.org_z)};
  g.direction = {lanes_of(ray.dir_x), lanes_of(ray.dir_y), lanes_of(ray.dir_z)};
  g.t = lanes_of(ray.tfar);
  g.right = hits.right;
  g.down = hits.down;
  const auto first = static_cast<std::size_t>(std::countr_zero(hits.surface));
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::size_t from = has_lane(hits.surface, lane) ? lane : first;
    if (from != lane) {
      for (Lanes3* lanes : {&g.origin, &g.direction, &g.right, &g.down})
        copy_lane(*lanes, from, lane);
      g.t[lane] = g.t[from];
    }
    const std::uint32_t triangle = hit.primID[from];
    const SurfaceRecord& surface = surfaces.record(triangle);
    points.material[lane] = &surfaces.material(surface);
    g.plane_normal.set(lane, surface.normal);
    g.normal.set(lane, surface.smooth
                           ? surfaces.interpolated_normal(triangle, hit.u[from], hit.v[from])
                           : surface.normal);
    g.u_gradient.set(lane, surface.u_gradient);
    g.v_gradient.set(lane, surface.v_gradient);
    g.u_offset[lane] = surface.u_offset;
    g.v_offset[lane] = surface.v_offset;
  }
  return g;
}

float dot(const Lanes3& a, const Lanes3& b, std::size_t lane) {
  return a.x[lane] * b.x[lane] + a.y[lane] * b.y[lane] + a.z[lane] * b.z[lane];
}

void set_geometry(const Gathered& g, SurfacePoints& points) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float length = std::sqrt(dot(g.direction, g.direction, i));
    points.view.x[i] = g.direction.x[i] / length;
    points.view.y[i] = g.direction.y[i] / length;
    points.view.z[i] = g.direction.z[i] / length;
    points.distance_m[i] = length * g.t[i];
    points.position.x[i] = g.origin.x[i] + g.t[i] * g.direction.x[i];
    points.position.y[i] = g.origin.y[i] + g.t[i] * g.direction.y[i];
    points.position.z[i] = g.origin.z[i] + g.t[i] * g.direction.z[i];
    const float side = dot(g.plane_normal, g.direction, i) > 0.0F ? -1.0F : 1.0F;
    points.plane_normal.x[i] = side * g.plane_normal.x[i];
    points.plane_normal.y[i] = side * g.plane_normal.y[i];
    points.plane_normal.z[i] = side * g.plane_normal.z[i];
    const float norm2 = dot(g.normal, g.normal, i);
    const float scale = norm2 > 0.0F ? side / std::sqrt(norm2) : 0.0F;
    points.normal.x[i] = scale * g.normal.x[i];
    points.normal.y[i] = scale * g.normal.y[i];
    points.normal.z[i] = scale * g.normal.z[i];
    points.u[i] = dot(g.u_gradient, points.position, i) + g.u_offset[i];
    points.v[i] = dot(g.v_gradient, points.position, i) + g.v_offset[i];
  }
}

// The hit moves with the direction d as t * (dd - d * (n . dd) / (n . d)): the Jacobian J of the
// texture coordinates. The unit circle of the pixel becomes an ellipse there, whose semi-axes are
// the eigenvectors of J J^T.
void set_footprints(const Gathered& g, SurfacePoints& points) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float along = dot(g.plane_normal, g.direction, i);
    const float slope_right = dot(g.plane_normal, g.right, i) / along;
    const float slope_down = dot(g.plane_normal, g.down, i) / along;
    const float u_along = dot(g.u_gradient, g.direction, i);
    const float v_along = dot(g.v_gradient, g.direction, i);
    const float u_x = g.t[i] * (dot(g.u_gradient, g.right, i) - slope_right * u_along);
    const float u_y = g.t[i] * (dot(g.u_gradient, g.down, i) - slope_down * u_along);
    const float v_x = g.t[i] * (dot(g.v_gradient, g.right, i) - slope_right * v_along);
    const float v_y = g.t[i] * (dot(g.v_gradient, g.down, i) - slope_down * v_along);

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
    const float major_m = std::min(std::sqrt(largest), kMost_m);
    const float area = std::abs(u_x * v_y - u_y * v_x);
    points.major_m[i] = major_m;
    points.minor_m[i] = major_m > 0.0F ? std::min(area / major_m, major_m) : 0.0F;
    const float scale = length > 0.0F ? major_m / length : 0.0F;
    points.major_u[i] = scale * eu;
    points.major_v[i] = scale * ev;
  }
}

}  // namespace

void locate(const SurfaceTable& surfaces, const SurfaceHits& hits, SurfacePoints& points) {
  if (hits.surface == 0) return;
  const Gathered gathered = gather(surfaces, hits, points);
  run_wide([&] {
    set_geometry(gathered, points);
    set_footprints(gathered, points);
  });
}

}  // namespace km
