#include "modules/simulation/rendering/light_bake.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace km {
namespace {

constexpr int kDirections = 48;
constexpr int kLampPoints = 12;
constexpr float kLampRadius_m = 0.25F;  // ceiling lights with a frosted cover
constexpr float kFar = std::numeric_limits<float>::infinity();

// Points spread evenly over the sphere (Fibonacci lattice), and their cosines to the axes as
// weights that sum up to one.
struct DirectionSet {
  std::array<Eigen::Vector3f, kDirections> directions;
  std::array<std::array<float, kAxisDirections>, kDirections> weights;
};

float cosine_to_axis(const Eigen::Vector3f& d, int axis) {
  return std::max(0.0F, axis % 2 == 0 ? d[axis / 2] : -d[axis / 2]);
}

DirectionSet make_directions() {
  DirectionSet set;
  std::array<float, kAxisDirections> sums{};
  for (int i = 0; i < kDirections; ++i) {
    const float z = 1.0F - (2.0F * static_cast<float>(i) + 1.0F) / kDirections;
    const float azimuth = static_cast<float>(i) * 2.0F * std::numbers::pi_v<float> *
                          (1.0F - 1.0F / std::numbers::phi_v<float>);
    const float radius = std::sqrt(1.0F - z * z);
    const Eigen::Vector3f d(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
    const auto index = static_cast<std::size_t>(i);
    set.directions[index] = d;
    for (int axis = 0; axis < kAxisDirections; ++axis) {
      set.weights[index][static_cast<std::size_t>(axis)] = cosine_to_axis(d, axis);
      sums[static_cast<std::size_t>(axis)] += cosine_to_axis(d, axis);
    }
  }
  for (auto& weights : set.weights)
    for (std::size_t axis = 0; axis < kAxisDirections; ++axis) weights[axis] /= sums[axis];
  return set;
}

const DirectionSet& direction_set() {
  static const DirectionSet set = make_directions();
  return set;
}

LaneMask mask_of(std::size_t count) {
  return (1U << count) - 1U;
}

}  // namespace

LightBake::LightBake(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
                     const Sky& sky)
    : lighting_(world.lighting),
      tracer_(tracer),
      surfaces_(surfaces),
      sky_(sky),
      indoors_(!(world.lighting.sun > 0.0F)) {}

std::vector<LightBake::Sample> LightBake::at(std::span<const Eigen::Vector3f> points) const {
  std::vector<Sample> samples(points.size());
  add_surroundings(points, samples);
  if (!lighting_.lamps.empty()) add_lamps(points, samples);
  return samples;
}

void LightBake::add_surroundings(std::span<const Eigen::Vector3f> points,
                                 std::vector<Sample>& samples) const {
  const DirectionSet& set = direction_set();
  RayPacket rays;
  std::array<int, kLanes> backs{};
  for (std::size_t i = 0; i < kDirections; ++i) {
    const Eigen::Vector3f& d = set.directions[i];
    for (std::size_t lane = 0; lane < points.size(); ++lane)
      set_ray(rays, static_cast<int>(lane), points[lane], d, 0.0F, kFar);
    tracer_.intersect(mask_of(points.size()), RayKind::kCoherent, rays);
    LaneMask hits = 0;
    for (std::size_t lane = 0; lane < points.size(); ++lane)
      if (rays.hit.primID[lane] != kNoTriangle) hits |= 1U << lane;
    const LaneMask lit = indoors_ ? 0U : sunlit(hits, rays);
    for (std::size_t lane = 0; lane < points.size(); ++lane) {
      float radiance = 0.0F;
      if ((hits >> lane & 1U) != 0U) {
        const SurfaceRecord& surface = surfaces_.record(rays.hit.primID[lane]);
        const bool back = surface.normal.dot(d) > 0.0F;
        backs[lane] += static_cast<int>(back && !(surfaces_.material(surface).transmission > 0.0F));
        radiance = reflected(surface, rays.ray.tfar[lane], (lit >> lane & 1U) != 0U);
      } else if (indoors_) {
        radiance = lighting_.ambient;
      } else {
        radiance = d.z() > 0.0F ? sky_.luminance(d) : 0.3F * sky_.haze_luminance();
      }
      for (std::size_t axis = 0; axis < kAxisDirections; ++axis)
        samples[lane].ambient[axis] += set.weights[i][axis] * radiance;
    }
  }
  for (std::size_t lane = 0; lane < points.size(); ++lane)
    samples[lane].inside = 3 * backs[lane] > kDirections;
}

// Which of the points that the rays have hit the sun shines on, from the side they are seen from.
LaneMask LightBake::sunlit(LaneMask hits, const RayPacket& rays) const {
  RayPacket shadow;
  LaneMask facing = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    if ((hits >> lane & 1U) == 0U) continue;
    const SurfaceRecord& surface = surfaces_.record(rays.hit.primID[lane]);
    const Eigen::Vector3f d(rays.ray.dir_x[lane], rays.ray.dir_y[lane], rays.ray.dir_z[lane]);
    const Eigen::Vector3f o(rays.ray.org_x[lane], rays.ray.org_y[lane], rays.ray.org_z[lane]);
    const float side = surface.normal.dot(d) > 0.0F ? -1.0F : 1.0F;
    if (side * surface.normal.dot(lighting_.to_sun) <= 0.0F) continue;
    facing |= 1U << lane;
    constexpr float kLift_m = 0.003F;
    const Eigen::Vector3f start = o + rays.ray.tfar[lane] * d + (side * kLift_m) * surface.normal;
    set_ray(shadow, lane, start, lighting_.to_sun, 0.0F, kFar);
  }
  return facing & ~tracer_.occluded(facing, RayKind::kCoherent, shadow);
}

// What a surface throws back: its mean albedo under the sun, if that shines there, and under a
// part of the sky. Indoors the surroundings count as lit like the room, but close ones are dark:
// they see little light themselves.
float LightBake::reflected(const SurfaceRecord& surface, float distance_m, bool sunlit) const {
  if (indoors_) {
    constexpr float kReach_m = 0.8F;
    return lighting_.ambient * (1.0F - std::exp(-distance_m / kReach_m));
  }
  constexpr float kSkySeen = 0.5F;
  const float direct =
      sunlit ? lighting_.sun * std::abs(surface.normal.dot(lighting_.to_sun)) : 0.0F;
  return surfaces_.material(surface).mean_luminance * (direct + kSkySeen * lighting_.ambient);
}

void LightBake::add_lamps(std::span<const Eigen::Vector3f> points,
                          std::vector<Sample>& samples) const {
  RayPacket rays;
  for (const Lighting::Lamp& lamp : lighting_.lamps) {
    for (Sample& sample : samples) sample.lamps.push_back(0.0F);
    for (int i = 0; i < kLampPoints; ++i) {
      // A disc that faces down, its points on a spiral of equal areas.
      const float radius = kLampRadius_m * std::sqrt((static_cast<float>(i) + 0.5F) / kLampPoints);
      const float azimuth = static_cast<float>(i) * 2.399963F;  // the golden angle
      const Eigen::Vector3f light =
          lamp.position +
          Eigen::Vector3f(radius * std::cos(azimuth), radius * std::sin(azimuth), 0.0F);
      // From the lamp to the points: rays that start together run together. The lamp's own body is
      // left behind.
      constexpr float kFirst = 0.05F;
      for (std::size_t lane = 0; lane < points.size(); ++lane)
        set_ray(rays, static_cast<int>(lane), light, points[lane] - light, kFirst, 0.999F);
      const LaneMask hidden = tracer_.occluded(mask_of(points.size()), RayKind::kCoherent, rays);
      for (std::size_t lane = 0; lane < points.size(); ++lane)
        if ((hidden >> lane & 1U) == 0U) samples[lane].lamps.back() += 1.0F / kLampPoints;
    }
  }
}

}  // namespace km
