#include "apps/lab/simulation/rendering/ray_tracer.hpp"

#include <cstring>
#include <stdexcept>
#include <string>

namespace km {
namespace {

struct alignas(64) ValidLanes {
  std::array<int, kLanes> lanes;

  explicit ValidLanes(LaneMask active) {
    for (int i = 0; i < kLanes; ++i)
      lanes[static_cast<std::size_t>(i)] = has_lane(active, static_cast<std::size_t>(i)) ? -1 : 0;
  }
};

// Rays of a packet run side by side.
#if RTC_VERSION_MAJOR >= 4
void find_hits(const ValidLanes& valid, RTCScene scene, RTCRayHit16& rays) {
  RTCIntersectArguments options;
  rtcInitIntersectArguments(&options);
  options.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid.lanes.data(), scene, &rays, &options);
}

void find_occluded(const ValidLanes& valid, RTCScene scene, RTCRay16& rays) {
  RTCOccludedArguments options;
  rtcInitOccludedArguments(&options);
  options.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded16(valid.lanes.data(), scene, &rays, &options);
}
#else
RTCIntersectContext coherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

void find_hits(const ValidLanes& valid, RTCScene scene, RTCRayHit16& rays) {
  RTCIntersectContext context = coherent();
  rtcIntersect16(valid.lanes.data(), scene, &context, &rays);
}

void find_occluded(const ValidLanes& valid, RTCScene scene, RTCRay16& rays) {
  RTCIntersectContext context = coherent();
  rtcOccluded16(valid.lanes.data(), scene, &context, &rays);
}
#endif

// Embree's checks read inactive lanes, too: they get a ray of length zero.
void prepare(LaneMask active, RTCRay16& rays) {
  for (int i = 0; i < kLanes; ++i) {
    if (has_lane(active, static_cast<std::size_t>(i))) continue;
    rays.org_x[i] = rays.org_y[i] = rays.org_z[i] = 0.0F;
    rays.dir_x[i] = rays.dir_y[i] = 0.0F;
    rays.dir_z[i] = 1.0F;
    rays.tnear[i] = rays.tfar[i] = 0.0F;
  }
  std::memset(rays.time, 0, sizeof(rays.time));
  std::memset(rays.mask, 0xFF, sizeof(rays.mask));
  std::memset(rays.flags, 0, sizeof(rays.flags));
}

void require_no_error(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree failed with error " + std::to_string(error));
}

// Copies the mesh: Embree pads its buffers, since it reads 16 bytes at the last vertex.
void attach_mesh(RTCDevice device, RTCScene scene, const SurfaceMesh& mesh) {
  if (mesh.triangles.empty()) return;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  constexpr std::size_t kVertexBytes = 3 * sizeof(float);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           kVertexBytes, mesh.vertices.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          sizeof(mesh.triangles[0]), mesh.triangles.size());
  if (vertices != nullptr && indices != nullptr) {
    std::memcpy(vertices, mesh.vertices.front().data(), kVertexBytes * mesh.vertices.size());
    std::memcpy(indices, mesh.triangles.data(), sizeof(mesh.triangles[0]) * mesh.triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
  }
  rtcReleaseGeometry(geometry);
}

}  // namespace

// One thread builds: the tree is then the same every time.
RayTracer::RayTracer(const SurfaceMesh& mesh) : device_(rtcNewDevice("threads=1,set_affinity=0")) {
  require_no_error(device_.get());
  scene_.reset(rtcNewScene(device_.get()));
  // Without it, rays pass between triangles that share an edge.
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  attach_mesh(device_.get(), scene_.get(), mesh);
  rtcCommitScene(scene_.get());
  require_no_error(device_.get());
}

void RayTracer::intersect(LaneMask active, RayPacket& rays) const {
  prepare(active, rays.ray);
  std::memset(rays.hit.primID, 0xFF, sizeof(rays.hit.primID));
  std::memset(rays.hit.geomID, 0xFF, sizeof(rays.hit.geomID));
  if (active == 0) return;
  find_hits(ValidLanes(active), scene_.get(), rays);
}

LaneMask RayTracer::occluded(LaneMask active, RayPacket& rays) const {
  if (active == 0) return 0;
  prepare(active, rays.ray);
  find_occluded(ValidLanes(active), scene_.get(), rays.ray);
  LaneMask hit = 0;  // Embree marks them with tfar = -infinity
  for (int i = 0; i < kLanes; ++i) hit |= static_cast<LaneMask>(rays.ray.tfar[i] < 0.0F) << i;
  return hit & active;
}

}  // namespace km
