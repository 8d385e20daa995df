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

TEST_CASE("Bytes that are no image of a map are refused", "[map_2d]") {
  const char* const image =
      GENERATE("", "P5", "P5 1 1 255", "P6\n1 1\n255\n.", "P5\n2 1\n255\n.", "P5\n0 0\n255\n",
               "P5\n-1 -1\n255\n.", "P5\n1 1\n65535\n.", "P5\n99999999 1\n255\n.", "P5 x 1 255\n.");
  CHECK_THROWS_AS(map_of_image(image), std::invalid_argument);
}

}  // namespace
}  // namespace km
