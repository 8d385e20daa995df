#include "dense_stereo.hpp"

#include <cmath>
#include <memory>
#include <utility>

#include "modules/core/depth_lookup.hpp"
#include "modules/dense_sensing/stereo_depth.hpp"

namespace km {
namespace {

// `depth` of the rectified camera as the real left one of `rig` sees it, through its lens.
DepthImage through_lens(const DepthImage& depth, const PinholeCamera& rectified,
                        const StereoRig& rig) {
  const PinholeCamera& left = rig.cameras[0];
  const SE3 T_rect_left = rectified.T_body_cam.inverse() * left.T_body_cam;
  DepthImage result{left.width, left.height, {}};
  for (int y = 0; y < left.height; ++y)
    for (int x = 0; x < left.width; ++x) {
      std::uint16_t& z_mm = result.millimetres.emplace_back(std::uint16_t{0});
      const auto bearing = left.unproject(Eigen::Vector2d(x, y));
      if (!bearing) continue;
      const Eigen::Vector3d ray = T_rect_left.linear() * bearing->homogeneous();
      const auto inverse_depth =
          inverse_depth_at(depth, rectified.project(ray.hnormalized()), depth_edge(rig));
      // z along the rectified axis; the left camera's differs by the turn between the two.
      if (inverse_depth)
        z_mm = static_cast<std::uint16_t>(std::lround(1e3 / (*inverse_depth * ray.z())));
    }
  return result;
}

}  // namespace

Recording as_rgbd(const Recording& recording, std::size_t every, std::size_t first) {
  const StereoRig& rig = recording.rig.stereo;
  constexpr double kMaxDepth_m = 60.0;  // with some to spare to 16 bits of millimetres
  StereoDepth stereo(rig, {.min_depth_m = 0.4, .max_depth_m = kMaxDepth_m});
  Recording rgbd = recording;
  rgbd.rig.stereo = rgbd_rig(rig.cameras[0], rig.baseline_m());
  rgbd.rig.depth = DepthRange{};
  for (std::size_t k = 0; k < rgbd.packets.size(); ++k) {
    SensorPacket& packet = rgbd.packets[k];
    const StereoFrame& pair = *packet.frame;
    StereoFrame frame{pair.stamp, pair.left, {}};
    if (k % every == first)
      frame.depth = std::make_shared<const DepthImage>(
          through_lens(stereo.compute(pair.left, pair.right), stereo.camera(), rig));
    packet.frame = std::make_shared<const StereoFrame>(std::move(frame));
  }
  return rgbd;
}

}  // namespace km
