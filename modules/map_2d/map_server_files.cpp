#include "modules/map_2d/map_server_files.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "modules/core/config.hpp"

namespace km {
namespace {

constexpr unsigned char kFreeShade = 254, kOccupiedShade = 0, kUnknownShade = 205;

char shade(std::int8_t cell) {
  return static_cast<char>(cell == OccupancyGrid::kUnknown ? kUnknownShade
                           : cell == OccupancyGrid::kFree  ? kFreeShade
                                                           : kOccupiedShade);
}

std::int8_t cell_of(char shade) {
  const auto value = static_cast<unsigned char>(shade);
  return value >= kFreeShade      ? OccupancyGrid::kFree
         : value >= kUnknownShade ? OccupancyGrid::kUnknown
                                  : OccupancyGrid::kOccupied;
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

OccupancyGrid map_of_image(std::string_view image) {
  constexpr std::size_t kMaxHead_bytes = 100;
  constexpr int kMaxSide = 1 << 20;
  std::istringstream head(std::string(image.substr(0, kMaxHead_bytes)));
  OccupancyGrid grid;
  std::string magic;
  int largest = 0;
  head >> magic >> grid.width >> grid.height >> largest;
  if (!head.good() || magic != "P5" || largest != 255 || std::min(grid.width, grid.height) < 1 ||
      std::max(grid.width, grid.height) > kMaxSide)
    throw std::invalid_argument("not a PGM image (P5) with 255 shades");
  const std::string_view shades = image.substr(static_cast<std::size_t>(head.tellg()) + 1);
  const auto width = static_cast<std::size_t>(grid.width);
  if (shades.size() != width * static_cast<std::size_t>(grid.height))
    throw std::invalid_argument("the image has " + std::to_string(shades.size()) +
                                " bytes, not one for each pixel");
  for (int y = grid.height - 1; y >= 0; --y)
    for (const char value : shades.substr(static_cast<std::size_t>(y) * width, width))
      grid.cells.push_back(cell_of(value));
  return grid;
}

std::string map_yaml(const OccupancyGrid& grid, std::string_view image_name) {
  return "image: " + std::string(image_name) +
         "\nmode: trinary\nresolution: " + shortest_text(grid.resolution_m) + "\norigin: [" +
         coordinate(grid.origin.x()) + ", " + coordinate(grid.origin.y()) +
         ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.19\nfloor_z: " +
         coordinate(grid.z_m) + '\n';
}

}  // namespace km
