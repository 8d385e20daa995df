#include <yaml-cpp/yaml.h>
#include <Eigen/Geometry>

#include "modules/map_2d/map_2d.hpp"
#include "modules/map_2d/map_server_files.hpp"
#include "modules/map_2d/node/map_2d_node.hpp"
#include "test/support/nav2_map.hpp"
#include "test/support/planned_path.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr LabelId kWallLabel = 1, kFloorLabel = 2;
constexpr std::int8_t kUnknown = OccupancyGrid::kUnknown, kFree = OccupancyGrid::kFree,
                      kOccupied = OccupancyGrid::kOccupied;

const LabelPalette& palette() {
  static const LabelPalette palette(
      {{kWallLabel, "wall", {1, 1, 1}}, {kFloorLabel, "floor", {2, 2, 2}}});
  return palette;
}

// Meshes of rectangles.
class Surfaces {
 public:
  // Parallelogram with a corner and two edges; free space is on the side of u x v.
  Surfaces& add(const Eigen::Vector3f& corner, const Eigen::Vector3f& u, const Eigen::Vector3f& v,
                LabelId label) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& vertex : {corner, Eigen::Vector3f(corner + u), Eigen::Vector3f(corner + u + v),
                               Eigen::Vector3f(corner + v)})
      mesh.vertices.push_back(vertex);
    mesh.labels.insert(mesh.labels.end(), 4, label);
    mesh.faces.push_back({first, first + 1, first + 2});
    mesh.faces.push_back({first, first + 2, first + 3});
    return *this;
  }

  // Level rectangle seen from above, or with `from_below` from below.
  Surfaces& level(float x0, float y0, float x1, float y1, float z, LabelId label,
                  bool from_below = false) {
    const Eigen::Vector3f u(x1 - x0, 0, 0), v(0, y1 - y0, 0);
    return from_below ? add({x0, y0, z}, v, u, label) : add({x0, y0, z}, u, v, label);
  }

  // Vertical rectangle over a segment, seen from its left side.
  Surfaces& wall(float x0, float y0, float x1, float y1, float z0, float z1) {
    return add({x0, y0, z0}, {0, 0, z1 - z0}, {x1 - x0, y1 - y0, 0}, kWallLabel);
  }

  // Room with floor and four walls, seen from inside.
  Surfaces& room(float x0, float y0, float x1, float y1) {
    level(x0, y0, x1, y1, 0, kFloorLabel);
    constexpr float kHigh = 2.5F;
    wall(x0, y0, x1, y0, 0, kHigh).wall(x1, y0, x1, y1, 0, kHigh);
    return wall(x1, y1, x0, y1, 0, kHigh).wall(x0, y1, x0, y0, 0, kHigh);
  }

  Surfaces& without_labels() {
    mesh.labels.clear();
    return *this;
  }

  LabelledMesh mesh;
};

OccupancyGrid map_of(const Surfaces& surfaces, const Map2dConfig& config = {}) {
  Map2dResult result = make_map_2d(config, {surfaces.mesh, palette()});
  REQUIRE(result.status == Map2dStatus::kMade);
  return result.grid;
}

// Values of the cells of a rectangle.
std::set<int> values(const OccupancyGrid& grid, double x0, double y0, double x1, double y1) {
  std::set<int> found;
  const double step = grid.resolution_m;
  for (double y = y0 + step / 2; y < y1; y += step)
    for (double x = x0 + step / 2; x < x1; x += step) found.insert(grid.at({x, y}));
  return found;
}

using Values = std::set<int>;

TEST_CASE("A room is free inside, its walls are occupied, and the outside is unknown") {
  Surfaces surfaces;
  surfaces.room(0, 0, 6, 4).wall(4, 2, 8, 2, 0, 2.5F);  // one wall continues outside
  if (GENERATE(true, false)) surfaces.without_labels();
  const OccupancyGrid grid = map_of(surfaces);
  CHECK(values(grid, 0.1, 0.1, 5.9, 1.9) == Values{kFree});
  CHECK(values(grid, 0.1, 2.1, 5.9, 3.9) == Values{kFree});
  CHECK(values(grid, 0, 0, 6, 0.05) == Values{kOccupied});
  CHECK(values(grid, 0, 0, 0.05, 4) == Values{kOccupied});
  CHECK(values(grid, 4, 2, 7, 2.05) == Values{kOccupied});
  CHECK(values(grid, 6.1, 0, 8, 1.9) == Values{kUnknown});
  CHECK(grid.at({-0.1, 1}) == kUnknown);
  CHECK(grid.at({100, -100}) == kUnknown);
}

TEST_CASE("A table is an obstacle only for robots that do not fit under it") {
  Surfaces surfaces;
  surfaces.room(0, 0, 6, 6).level(2, 2, 3.5F, 3, 0.75F, kWallLabel);
  SECTION("floor below it was seen") {}
  SECTION("without labels") {
    surfaces.without_labels();
  }
  Map2dConfig low{.max_height_m = 0.5};
  CHECK(values(map_of(surfaces, low), 2.05, 2.05, 3.45, 2.95) == Values{kFree});
  CHECK(values(map_of(surfaces), 2.05, 2.05, 3.45, 2.95) == Values{kOccupied});
}

TEST_CASE("A table over unseen floor is an obstacle") {
  Surfaces surfaces;
  // The table fills most of its tile of 2 m, and no floor is seen below it.
  surfaces.level(0, 0, 6, 2, 0, 0).level(0, 4, 6, 6, 0, 0).level(2.1F, 2.1F, 3.9F, 3.1F, 0.75F, 0);
  surfaces.without_labels();
  CHECK(values(map_of(surfaces), 2.15, 2.15, 3.85, 3.05) == Values{kOccupied});
}

TEST_CASE("Ramps and stairs that are labelled as floor are free") {
  const bool labelled = GENERATE(true, false);
  Surfaces surfaces;
  surfaces.level(0, 0, 4, 4, 0, kFloorLabel);
  SECTION("steep ramp, 42 degrees") {
    surfaces.add({4, 0, 0}, {2, 0, 1.8F}, {0, 4, 0}, kFloorLabel);
  }
  SECTION("stairs") {
    for (int k = 0; k < 7; ++k) {
      const float x = 4.0F + 0.3F * static_cast<float>(k), z = 0.17F * static_cast<float>(k);
      surfaces.add({x, 0, z}, {0, 4, 0}, {0, 0, 0.17F}, kFloorLabel);
      surfaces.level(x, 0, x + 0.3F, 4, z + 0.17F, kFloorLabel);
    }
  }
  surfaces.level(6.1F, 0, 9, 4, labelled ? 1.19F : 0.0F, kFloorLabel);
  if (!labelled) surfaces.without_labels();
  const auto found = values(map_of(surfaces), 4.3, 0.1, 5.9, 3.9);
  CHECK(found.contains(kOccupied) != labelled);
  CHECK(found.contains(kFree) == labelled);
}

TEST_CASE("A labelled box with a slope to the floor is an obstacle, and a labelled carpet is not") {
  Surfaces surfaces;
  surfaces.level(0, 0, 2.5F, 4, 0, kFloorLabel).level(3.5F, 0, 6, 4, 0, kFloorLabel);
  const bool is_carpet = GENERATE(true, false);
  const float top = is_carpet ? 0.02F : 0.26F;
  surfaces.add({2.5F, 1, 0}, {0.5F, 0, top}, {0, 1, 0}, kWallLabel);
  surfaces.level(3, 1, 3.5F, 2, top, kWallLabel);
  CHECK(values(map_of(surfaces), 3.05, 1.05, 3.45, 1.95) == Values{is_carpet ? kFree : kOccupied});
}

TEST_CASE("Two floors are free, and the step between them is not") {
  Surfaces surfaces;
  surfaces.level(0, 0, 5, 4, 0, kFloorLabel).level(5, 0, 10, 4, 0.6F, kFloorLabel);
  if (GENERATE(true, false)) surfaces.without_labels();
  const OccupancyGrid grid = map_of(surfaces);
  CHECK(values(grid, 0.1, 0.1, 4.9, 3.9) == Values{kFree});
  CHECK(values(grid, 5.1, 0.1, 9.9, 3.9) == Values{kFree});
  CHECK(values(grid, 4.95, 0.1, 5.0, 3.9) == Values{kOccupied});
  Map2dConfig climber{.max_step_m = 0.7};
  if (!surfaces.mesh.labels.empty())
    CHECK(values(map_of(surfaces, climber), 0.1, 0.1, 9.9, 3.9) == Values{kFree});
}

TEST_CASE("Rays through the band free cells, and follow the poses of their keyframes") {
  Surfaces surfaces;
  surfaces.level(0, 0, 1, 4, 0, kFloorLabel).wall(2.5F, 4, 2.5F, 0, 0, 2);
  std::vector<ViewRays> views(2);
  for (ViewRays& view : views) {  // two images, so that two rays cross each cell
    view = {.keyframe = 1, .origin = {0.5F, 2, 0.2F}, .ends = {}};
    for (float y = 1.5F; y <= 2.5F; y += 0.02F) view.ends.emplace_back(2.5F, y, 0.3F);
    view.ends.emplace_back(2.3F, 3.9F, 2.6F);  // too high from y = 2.2 on
  }
  std::vector<SE3> T_world_odom(2, SE3::Identity());
  const auto map = [&] {
    return make_map_2d({}, {surfaces.mesh, palette(), views, T_world_odom}).grid;
  };
  CHECK(values(map(), 2.0, 1.7, 2.35, 2.3) == Values{kFree});
  CHECK(values(map(), 2.0, 3.0, 2.3, 3.8) == Values{kUnknown});
  CHECK(values(map(), 2.5, 1.0, 2.55, 3.0) == Values{kOccupied});

  T_world_odom[1].translation().y() = 1.5;  // the optimiser moves the keyframe
  CHECK(values(map(), 2.0, 1.0, 2.35, 2.3) == Values{kUnknown});
  CHECK(values(map(), 2.0, 3.2, 2.35, 3.8) == Values{kFree});

  T_world_odom.resize(1);  // the pose of the keyframe is unknown
  CHECK(values(map(), 1.1, 0.0, 2.4, 4.0) == Values{kUnknown});
}

// Two images from `eye` of a yard of 10 m x 6 m with a box.
void look_from(const Eigen::Vector3d& eye, const Eigen::AlignedBox3d& box,
               std::vector<ViewRays>& views) {
  ViewRays view{.keyframe = 0, .origin = eye.cast<float>(), .ends = {}};
  const auto look_at = [&](const Eigen::Vector3d& target) {
    double t = 0.0;
    while (t < 1.0 && !box.contains(Eigen::Vector3d(eye + t * (target - eye)))) t += 0.002;
    view.ends.push_back((eye + std::min(t, 1.0) * (target - eye)).cast<float>());
  };
  for (double y = 0.05; y < 6.0; y += 0.05) {
    for (double x = 0.05; x < 10.0; x += 0.1) look_at({x, y, 0.0});
    for (double z = 0.1; z < 1.5; z += 0.1) look_at({10.0, y, z});
  }
  views.insert(views.end(), 2, view);
}

TEST_CASE("A path through free cells does not touch a box of which only the front is mapped") {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(4, 1.5, 0), Eigen::Vector3d(6, 4.5, 0.9));
  Surfaces surfaces;
  surfaces.level(0, 0, 3, 6, 0, kFloorLabel).level(7, 0, 9, 2, 0, kFloorLabel);
  surfaces.wall(4, 4.5F, 4, 1.5F, 0, 0.9F).wall(10, 0, 10, 6, 0, 2.5F);
  std::vector<ViewRays> views;
  for (const Eigen::Vector3d& eye :
       {Eigen::Vector3d(1, 0.8, 1.2), Eigen::Vector3d(1, 3, 1.2), Eigen::Vector3d(8, 1, 1.2)})
    look_from(eye, box, views);
  const std::vector<SE3> T_world_odom(1, SE3::Identity());
  const OccupancyGrid grid = make_map_2d({}, {surfaces.mesh, palette(), views, T_world_odom}).grid;
  const std::vector<Eigen::Vector2d> path = planned_path(grid, {1, 3}, {7.5, 3});
  REQUIRE_FALSE(path.empty());
  for (const Eigen::Vector2d& p : path)
    CHECK_FALSE(box.contains(Eigen::Vector3d(p.x(), p.y(), 0.1)));
}

TEST_CASE("Without floor there is no map, and a map that is too large is refused") {
  const Map2dConfig config;
  CHECK(make_map_2d(config, {LabelledMesh{}, palette()}).status == Map2dStatus::kEmpty);
  Surfaces walls;
  walls.wall(0, 0, 4, 0, 0, 2).without_labels();
  CHECK(make_map_2d(config, {walls.mesh, palette()}).status == Map2dStatus::kEmpty);

  Surfaces far;
  far.room(0, 0, 4, 4).level(1e6F, 1e6F, 1e6F + 1, 1e6F + 1, 0, kFloorLabel);
  const Map2dResult refused = make_map_2d(config, {far.mesh, palette()});
  CHECK(refused.status == Map2dStatus::kTooLarge);
  CHECK(refused.grid.empty());
  CHECK(refused.cells_needed == Approx(4e14).epsilon(0.01));

  far.mesh.vertices.back().x() = std::numeric_limits<float>::infinity();
  CHECK(make_map_2d(config, {far.mesh, palette()}).status == Map2dStatus::kTooLarge);
}

TEST_CASE("map_server reads the map that was written") {
  OccupancyGrid grid{0.05, {-1.25, 10.0}, 3, 2, {}};
  grid.cells = {OccupancyGrid::kFree,     OccupancyGrid::kOccupied, OccupancyGrid::kUnknown,
                OccupancyGrid::kOccupied, OccupancyGrid::kFree,     OccupancyGrid::kFree};
  grid.z_m = -0.3;
  const std::string yaml = map_yaml(grid, "map.pgm");
  CHECK(YAML::Load(yaml)["image"].as<std::string>() == "map.pgm");
  CHECK(YAML::Load(yaml)["floor_z"].as<double>() == -0.3);
  const OccupancyGrid read = load_nav2_map(yaml, map_image(grid));
  CHECK(read.resolution_m == grid.resolution_m);
  CHECK(read.origin == grid.origin);
  CHECK(read.width == 3);
  CHECK(read.cells == grid.cells);
  CHECK(map_of_image(map_image(grid)).cells == grid.cells);
  CHECK(map_of_image(map_image(grid)).width == 3);
}

TEST_CASE("Bytes that are no image of a map are refused") {
  const char* const image =
      GENERATE("", "P5", "P5 1 1 255", "P6\n1 1\n255\n.", "P5\n2 1\n255\n.", "P5\n0 0\n255\n",
               "P5\n-1 -1\n255\n.", "P5\n1 1\n65535\n.", "P5\n99999999 1\n255\n.", "P5 x 1 255\n.");
  CHECK_THROWS_AS(map_of_image(image), std::invalid_argument);
}

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

TEST_CASE("Rays end on the surface that the camera sees, up to a range") {
  const auto millimetres = GENERATE(std::uint16_t{2000}, std::uint16_t{9000});
  RayThinner thinner(camera(), 5.0);
  const auto rays = thinner.add(frame_at(1, millimetres));
  REQUIRE(rays);
  CHECK(rays->origin == Eigen::Vector3f(1, 2, 1));
  CHECK(rays->ends.size() > 500);
  for (const Eigen::Vector3f& end : rays->ends)
    REQUIRE(end.x() == Approx(1.0 + std::min(millimetres / 1000.0, 5.0)));
}

TEST_CASE("Images without depth, of another size or from nearly the same pose give no rays") {
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

TEST_CASE("The node maps the last mesh and moves the rays with its keyframes") {
  Topic<DenseFrame> frames;
  Topic<OccupancyGrid> maps;
  std::vector<OccupancyGrid> received;
  In<OccupancyGrid>(maps).subscribe([&](const auto& map) { received.push_back(*map); });
  Map2dNode node({}, palette(), RayThinner(camera(), 5.0), {frames, maps});
  node.start();
  for (const double x : {0.0, 0.4, 0.8}) frames.publish(frame_at(x, 2000));
  Surfaces surfaces;
  surfaces.level(0, 0, 1, 4, 0, kFloorLabel).wall(2.78F, 4, 2.78F, 0, 0, 2);
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
