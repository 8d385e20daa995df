#pragma once

#include <yaml-cpp/yaml.h>

#include "modules/core/map/occupancy_grid.hpp"
#include "test/support/test.hpp"

namespace km {

/// Loads a map as the documentation of Nav2's map_server describes it: a pixel x has the occupation
/// p = (255 - x) / 255, or x / 255 if negate is set. In mode trinary it is occupied for p >
/// occupied_thresh, free for p < free_thresh, and otherwise unknown. `origin` is the pose of the
/// lower left pixel.
inline OccupancyGrid load_nav2_map(const std::string& yaml, const std::string& image) {
  const YAML::Node map = YAML::Load(yaml);
  REQUIRE(map["mode"].as<std::string>() == "trinary");
  REQUIRE(map["origin"].size() == 3);
  CHECK(map["origin"][2].as<double>() == 0.0);
  OccupancyGrid grid{.resolution_m = map["resolution"].as<double>(), .cells = {}};
  grid.origin = {map["origin"][0].as<double>(), map["origin"][1].as<double>()};
  std::istringstream stream(image);
  std::string magic;
  int largest = 0;
  stream >> magic >> grid.width >> grid.height >> largest;
  REQUIRE(magic == "P5");
  REQUIRE(largest == 255);
  stream.get();
  grid.cells.resize(static_cast<std::size_t>(grid.width * grid.height));
  for (int row = 0; row < grid.height; ++row)
    for (int x = 0; x < grid.width; ++x) {
      const double shade = stream.get() / 255.0;
      const double p = map["negate"].as<int>() != 0 ? shade : 1.0 - shade;
      grid.cells[grid.index(x, grid.height - 1 - row)] =
          p > map["occupied_thresh"].as<double>() ? OccupancyGrid::kOccupied
          : p < map["free_thresh"].as<double>()   ? OccupancyGrid::kFree
                                                  : OccupancyGrid::kUnknown;
    }
  CHECK(stream.peek() == std::istringstream::traits_type::eof());
  return grid;
}

}  // namespace km
