#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "modules/core/depth_lookup.hpp"
#include "test/support/recorded_kitchen.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

// Median distance [m] of the depths of frame a, carried into b, from those that b has there.
double depth_disagreement(const PosedFrame& a, const PosedFrame& b, const PinholeCamera& camera) {
  const SE3 T_b_a = b.T_world_cam.inverse() * a.T_world_cam;
  std::vector<double> errors;
  for (int y = 4; y < camera.height; y += 8)
    for (int x = 4; x < camera.width; x += 8) {
      const Eigen::Vector2d px(x, y);
      const auto rho_a = inverse_depth_at(*a.frame->depth, px, 0.05);
      if (!rho_a) continue;
      const Eigen::Vector3d p_b = T_b_a * (camera.unproject(px)->homogeneous() / *rho_a);
      if (p_b.z() < 0.1) continue;
      const auto rho_b = inverse_depth_at(*b.frame->depth, camera.project(p_b.hnormalized()), 0.05);
      if (rho_b) errors.push_back(std::abs(1.0 / *rho_b - p_b.z()));
    }
  REQUIRE(errors.size() > 500);
  const auto median = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), median, errors.end());
  return *median;
}

TEST_CASE("7-Scenes red kitchen: depth and poses agree on the room", "[sensors]") {
  const auto folder = shared_data("7scenes_redkitchen");
  if (!folder) return;
  RecordedKitchen kitchen(*folder);
  CHECK(kitchen.frame_count() == 250);
  std::vector<PosedFrame> frames;
  while (frames.size() < 12) frames.push_back(kitchen.next().value());
  CHECK(frames[1].frame->stamp == 133'333'333);  // every fourth of 30 Hz
  for (const PosedFrame& frame : frames) {
    const auto& depths = frame.frame->depth->millimetres;
    const auto known = static_cast<double>(
        std::count_if(depths.begin(), depths.end(), [](std::uint16_t z) { return z > 0; }));
    CHECK(known > 0.5 * 640 * 480);
    CHECK(*std::max_element(depths.begin(), depths.end()) < 20'000);  // 65535 is none
  }
  // Kinect's noise at 2 to 3 m is a centimetre or two.
  CHECK(depth_disagreement(frames[0], frames[4], kitchen.rig().cameras[0]) < 0.03);
  CHECK(depth_disagreement(frames[0], frames[11], kitchen.rig().cameras[0]) < 0.04);
}

}  // namespace
}  // namespace km
