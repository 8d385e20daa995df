#include "modules/map_2d/map_2d.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "test/modules/map_2d/surfaces.hpp"

namespace km {
namespace {

using test::kFloorLabel;
using test::kWallLabel;
using test::Surfaces;

constexpr std::int8_t kUnknown = OccupancyGrid::kUnknown, kFree = OccupancyGrid::kFree,
                      kOccupied = OccupancyGrid::kOccupied;

const LabelPalette& palette() {
  static const LabelPalette palette = test::two_class_palette();
  return palette;
}

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

TEST_CASE("A room is free inside, its walls are occupied, and the outside is unknown", "[map_2d]") {
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

TEST_CASE("A table is an obstacle only for robots that do not fit under it", "[map_2d]") {
  Surfaces surfaces;
  surfaces.room(0, 0, 6, 6).level(2, 2, 3.5F, 3, 0.75F, kWallLabel);
  SECTION("floor below it was seen") {}
  SECTION("without labels") {
    surfaces.without_labels();
  }
  Map2dConfig low;
  low.max_height_m = 0.5;
  CHECK(values(map_of(surfaces, low), 2.05, 2.05, 3.45, 2.95) == Values{kFree});
  CHECK(values(map_of(surfaces), 2.05, 2.05, 3.45, 2.95) == Values{kOccupied});
}

TEST_CASE("A table over unseen floor is an obstacle", "[map_2d]") {
  Surfaces surfaces;
  // The table fills most of its tile of 2 m, and no floor is seen below it.
  surfaces.level(0, 0, 6, 2, 0, 0).level(0, 4, 6, 6, 0, 0).level(2.1F, 2.1F, 3.9F, 3.1F, 0.75F, 0);
  surfaces.without_labels();
  CHECK(values(map_of(surfaces), 2.15, 2.15, 3.85, 3.05) == Values{kOccupied});
}

TEST_CASE("Ramps and stairs that are labelled as floor are free", "[map_2d]") {
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

TEST_CASE("Two floors are free, and the step between them is not", "[map_2d]") {
  Surfaces surfaces;
  surfaces.level(0, 0, 5, 4, 0, kFloorLabel).level(5, 0, 10, 4, 0.6F, kFloorLabel);
  if (GENERATE(true, false)) surfaces.without_labels();
  const OccupancyGrid grid = map_of(surfaces);
  CHECK(values(grid, 0.1, 0.1, 4.9, 3.9) == Values{kFree});
  CHECK(values(grid, 5.1, 0.1, 9.9, 3.9) == Values{kFree});
  CHECK(values(grid, 4.95, 0.1, 5.0, 3.9) == Values{kOccupied});
  Map2dConfig climber;
  climber.max_step_m = 0.7;
  if (!surfaces.mesh.labels.empty())
    CHECK(values(map_of(surfaces, climber), 0.1, 0.1, 9.9, 3.9) == Values{kFree});
}

TEST_CASE("Rays through the band free cells, and follow the poses of their keyframes", "[map_2d]") {
  Surfaces surfaces;
  surfaces.level(0, 0, 1, 4, 0, kFloorLabel).wall(2.5F, 4, 2.5F, 0, 0, 2);
  std::vector<ViewRays> views(2);
  for (ViewRays& view : views) {  // two images, so that two rays cross each cell
    view = {.keyframe = 1, .origin = {0.5F, 2, 1}, .ends = {}};
    for (float y = 1.5F; y <= 2.5F; y += 0.02F) view.ends.emplace_back(2.5F, y, 0.5F);
    view.ends.emplace_back(0.5F, 3.9F, 2.6F);  // above the band from y = 2.6 on
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

TEST_CASE("Without floor there is no map, and a map that is too large is refused", "[map_2d]") {
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

}  // namespace
}  // namespace km
