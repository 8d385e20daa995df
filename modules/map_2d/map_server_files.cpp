#include "modules/map_2d/map_server_files.hpp"

#include <cmath>

#include "modules/core/config.hpp"

namespace km {
namespace {

char shade(std::int8_t cell) {
  constexpr unsigned char kFree = 254, kOccupied = 0, kUnknown = 205;
  return static_cast<char>(cell == OccupancyGrid::kUnknown ? kUnknown
                           : cell == OccupancyGrid::kFree  ? kFree
                                                           : kOccupied);
}

// Coordinate [m] as text, without the rounding errors of multiples of the resolution.
std::string coordinate(double value_m) {
  return shortest_text(std::round(value_m * 1e6) / 1e6);
}

}  // namespace

std::string map_image(const OccupancyGrid& grid) {
  std::string image =
      "P5\n" + std::to_string(grid.width) + ' ' + std::to_string(grid.height) + "\n255\n";
  image.reserve(image.size() + grid.cells.size());
  for (int y = grid.height - 1; y >= 0; --y)
    for (int x = 0; x < grid.width; ++x) image.push_back(shade(grid.cells[grid.index(x, y)]));
  return image;
}

std::string map_yaml(const OccupancyGrid& grid, std::string_view image_name) {
  return "image: " + std::string(image_name) +
         "\nmode: trinary\nresolution: " + shortest_text(grid.resolution_m) + "\norigin: [" +
         coordinate(grid.origin.x()) + ", " + coordinate(grid.origin.y()) +
         ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.19\n";
}

}  // namespace km
