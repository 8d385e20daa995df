#include "modules/map_2d/node/map_2d_node.hpp"

#include <catch2/catch.hpp>

#include "test/modules/map_2d/surfaces.hpp"

namespace km {
namespace {

// A camera of 90 degrees that looks along x of the odometry frame, with z up.
Camera camera() {
  return {.width = 64, .height = 64, .fx = 32, .fy = 32, .cx = 31.5, .cy = 31.5};
}

DenseFrame frame_at(double x, std::uint16_t millimetres) {
  DepthImage depth{64, 64, std::vector<std::uint16_t>(64 * 64, millimetres)};
  DenseFrame frame{.depth = std::make_shared<const DepthImage>(std::move(depth))};
  frame.T_odom_cam.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  frame.T_odom_cam.translation() = Eigen::Vector3d(x, 2, 1);
  return frame;
}

TEST_CASE("Rays end on the surface that the camera sees, up to a range", "[map_2d]") {
  const auto millimetres = GENERATE(std::uint16_t{2000}, std::uint16_t{9000});
  RayThinner thinner(camera(), 5.0);
  const auto rays = thinner.add(frame_at(1, millimetres));
  REQUIRE(rays);
  CHECK(rays->origin == Eigen::Vector3f(1, 2, 1));
  CHECK(rays->ends.size() > 500);
  for (const Eigen::Vector3f& end : rays->ends)
    REQUIRE(end.x() == Approx(1.0 + std::min(millimetres / 1000.0, 5.0)));
}

TEST_CASE("Images without depth, of another size or from nearly the same pose give no rays",
          "[map_2d]") {
  RayThinner thinner(camera(), 5.0);
  CHECK(thinner.add(frame_at(0, 0))->ends.empty());
  CHECK_FALSE(thinner.add(frame_at(0.2, 2000)));
  CHECK(thinner.add(frame_at(0.4, 2000)));
  DenseFrame turned = frame_at(0.4, 2000);
  turned.T_odom_cam.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()));
  CHECK(thinner.add(turned));
  DenseFrame small = frame_at(5, 2000);
  small.depth = std::make_shared<const DepthImage>(DepthImage{1, 1, {2000}});
  CHECK_FALSE(thinner.add(small));
}

TEST_CASE("The node maps the last mesh and moves the rays with its keyframes", "[map_2d]") {
  Topic<DenseFrame> frames;
  Topic<OccupancyGrid> maps;
  std::vector<OccupancyGrid> received;
  In<OccupancyGrid>(maps).subscribe([&](const auto& map) { received.push_back(*map); });
  Map2dNode node({}, test::two_class_palette(), RayThinner(camera(), 5.0), {frames, maps});
  node.start();
  for (const double x : {0.0, 0.4, 0.8}) frames.publish(frame_at(x, 2000));
  test::Surfaces surfaces;
  surfaces.level(0, 0, 1, 4, 0, test::kFloorLabel).wall(2.78F, 4, 2.78F, 0, 0, 2);
  const auto mesh = std::make_shared<const LabelledMesh>(surfaces.mesh);
  SE3 moved = SE3::Identity();
  moved.translation().y() = 1.5;
  node.offer({mesh, {moved}});
  node.offer({mesh, {SE3::Identity()}, 7});
  node.stop();
  node.stop();
  REQUIRE_FALSE(received.empty());
  CHECK(received.size() <= 3);  // each mesh at most once, and all images at the end
  CHECK(received.back().at({2.02, 2.02}) == OccupancyGrid::kFree);
  CHECK(received.back().at({2.02, 3.72}) == OccupancyGrid::kUnknown);
  CHECK(received.back().at({2.79, 2.02}) == OccupancyGrid::kOccupied);
  CHECK(received.back().anchor == 7);
  CHECK(node.timing().count() == received.size());
}

}  // namespace
}  // namespace km
