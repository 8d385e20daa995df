#include "modules/map_2d/map_server_files.hpp"

#include <yaml-cpp/yaml.h>

#include <catch2/catch.hpp>

#include "test/support/nav2_map.hpp"

namespace km {
namespace {

TEST_CASE("map_server reads the map that was written", "[map_2d]") {
  OccupancyGrid grid{0.05, {-1.25, 10.0}, 3, 2, {}};
  grid.cells = {OccupancyGrid::kFree,     OccupancyGrid::kOccupied, OccupancyGrid::kUnknown,
                OccupancyGrid::kOccupied, OccupancyGrid::kFree,     OccupancyGrid::kFree};
  const std::string yaml = map_yaml(grid, "map.pgm");
  CHECK(YAML::Load(yaml)["image"].as<std::string>() == "map.pgm");
  const OccupancyGrid read = load_nav2_map(yaml, map_image(grid));
  CHECK(read.resolution_m == grid.resolution_m);
  CHECK(read.origin == grid.origin);
  CHECK(read.width == 3);
  CHECK(read.cells == grid.cells);
}

}  // namespace
}  // namespace km
