#include "apps/evaluate/map_quality.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr LabelId kWall = 2;

LabelPalette palette() {
  return LabelPalette(std::vector<LabelClass>{{1, "floor", {0, 0, 0}}, {kWall, "wall", {9, 9, 9}}});
}

// A wall of 4 x 2 m in the plane y = `y_m`, from x = 0 to x = `length_m`.
LabelledMesh wall(float y_m, float length_m = 4.0F) {
  return rectangle({0, y_m, 0}, {length_m, 0, 0}, {0, 0, 2}, 40, kWall);
}

std::vector<SeenPoint> seen_wall() {
  std::vector<SeenPoint> seen;
  for (float x = 0.05F; x < 4.0F; x += 0.1F)
    for (float z = 0.05F; z < 2.0F; z += 0.1F)
      seen.push_back({{x, 0, z}, x < 2.0F ? 5.0F : 15.0F, kWall});
  return seen;
}

TEST_CASE("The share of seen surface in a map is stated by depth and class") {
  const MapQuality quality = map_quality(wall(0.0F), wall(0.1F, 2.0F), seen_wall(), palette());
  CHECK(quality.by_depth[0].within_20cm == Approx(1.0));
  CHECK(quality.by_depth[0].within_5cm == Approx(0.0));
  CHECK(quality.by_depth[1].within_20cm < 0.11);  // at the border alone
  CHECK(quality.by_class[kWall].points == seen_wall().size());
  CHECK(quality.median_mm == Approx(100.0).margin(1.0));
  CHECK(quality.rim_m_per_m2 == Approx(8.0 / 4.0));
}

TEST_CASE("A zigzag wall has the angle and the rms of its slopes") {
  LabelledMesh zigzag = wall(0.0F);
  for (Eigen::Vector3f& p : zigzag.vertices)
    if (std::lround(p.x() / 0.1F) % 2 != 0) p.y() = 0.02F;
  const MapQuality quality = map_quality(wall(0.0F), zigzag, seen_wall(), palette());
  CHECK(quality.wall_deg == Approx(11.3).margin(0.1));                       // atan(0.02 / 0.1)
  CHECK(quality.wall_rms_mm == Approx(20.0 / std::sqrt(12.0)).margin(0.3));  // uniform
  CHECK(map_quality(wall(0.0F), wall(0.0F), seen_wall(), palette()).wall_deg < 0.1);
}

}  // namespace
}  // namespace km
