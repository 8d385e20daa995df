#include "apps/lab/simulation/rendering/ray_tracer.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "test/apps/lab/simulation/rendering/small_world.hpp"

namespace km {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

// A square of 2 m in the plane x = 5.
SurfaceMesh screen() {
  small_world::Builder builder;
  builder.wall(5.0F, 1.0F, builder.material(SurfaceClass::kWall, 0.5F));
  return builder.build().mesh;
}

// Every byte of the rays has the value of uninitialised memory.
RayPacket unwritten(int byte) {
  RayPacket rays;
  std::memset(&rays, byte, sizeof(rays));
  return rays;
}

}  // namespace

TEST_CASE("Lanes that are not active need no ray, with any of Embree's kernels",
          "[simulation][rendering]") {
  const auto* const instruction_set = GENERATE("", "sse2", "avx", "avx2");
  // 0xFF: NaN; 0xBF: -1.5 in all fields, which is before the start of the ray.
  const int byte = GENERATE(0xFF, 0xBF, 0x7F);
  CAPTURE(instruction_set, byte);
  const RayTracer tracer(screen(), instruction_set);
  const LaneMask active = GENERATE(LaneMask{0x0001}, LaneMask{0x0100}, LaneMask{0x5A3C});
  CAPTURE(active);
  RayPacket rays = unwritten(byte);
  RayPacket shadows = unwritten(byte);
  LaneMask at_screen = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    if ((active >> lane & 1U) == 0U) continue;
    const Eigen::Vector3f direction(lane % 3 == 0 ? -1.0F : 1.0F, 0.01F, 0.02F);
    if (direction.x() > 0.0F) at_screen |= 1U << lane;
    set_ray(rays, lane, Eigen::Vector3f::Zero(), direction, 0.0F, kFar);
    set_ray(shadows, lane, Eigen::Vector3f::Zero(), direction, 0.0F, kFar);
  }
  CHECK(tracer.occluded(active, shadows) == at_screen);
  tracer.intersect(active, rays);
  for (int lane = 0; lane < kLanes; ++lane) {
    const bool hit = (at_screen >> lane & 1U) != 0U;
    CHECK((rays.hit.primID[lane] != kNoTriangle) == hit);
    if (hit) CHECK(rays.ray.tfar[lane] == Approx(5.0F));
  }
}

}  // namespace km
