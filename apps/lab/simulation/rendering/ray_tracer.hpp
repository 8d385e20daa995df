#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstdint>
#include <memory>

#include "apps/lab/simulation/rendering/lanes.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {

/// Triangle of a ray that hit nothing.
inline constexpr std::uint32_t kNoTriangle = RTC_INVALID_GEOMETRY_ID;

/// A packet of rays and their hits, in Embree's layout.
using RayPacket = RTCRayHit16;

/// Embree's acceleration structure over a mesh. Immutable, safe to use from several threads. It is
/// fastest if the rays of a packet are neighbours; other rays give correct results, too.
class RayTracer {
 public:
  /// Copies `mesh`. Throws std::runtime_error with Embree's error code.
  explicit RayTracer(const SurfaceMesh& mesh);

  /// Nearest hits of the rays in `active` between tnear and tfar: primID, u, v; tfar becomes the
  /// distance of the hit. The other lanes get kNoTriangle and a ray of length zero; they need not
  /// be set.
  void intersect(LaneMask active, RayPacket& rays) const;

  /// Mask of the rays in `active` that hit any surface. The other lanes need not be set.
  [[nodiscard]] LaneMask occluded(LaneMask active, RayPacket& rays) const;

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

/// Sets ray `lane` of a packet.
inline void set_ray(RayPacket& rays, int lane, const Eigen::Vector3f& origin,
                    const Eigen::Vector3f& direction, float near, float far) {
  rays.ray.org_x[lane] = origin.x();
  rays.ray.org_y[lane] = origin.y();
  rays.ray.org_z[lane] = origin.z();
  rays.ray.dir_x[lane] = direction.x();
  rays.ray.dir_y[lane] = direction.y();
  rays.ray.dir_z[lane] = direction.z();
  rays.ray.tnear[lane] = near;
  rays.ray.tfar[lane] = far;
}

}  // namespace km
