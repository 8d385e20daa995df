#pragma once

#include <string>
#include <string_view>

#include "modules/core/map/occupancy_grid.hpp"

namespace km {

/// A 2D map as the files that map_server of Nav2 loads (nav2_map_server, mode trinary).
///
/// Returns a PGM image (P5). Free cells are 254, occupied ones 0, unknown ones 205, as map_saver
/// writes them. The first row of the image is the row of the grid with the largest y.
[[nodiscard]] std::string map_image(const OccupancyGrid& grid);

/// The cells of map_image(): a grid with the default resolution at the origin. Throws
/// std::invalid_argument for bytes that are not such an image.
[[nodiscard]] OccupancyGrid map_of_image(std::string_view image);

/// Returns the YAML file of the image `image_name`, which is relative to the YAML file. The
/// thresholds are on the probability of occupation (255 - value) / 255. Unknown cells have 0.196,
/// so free_thresh is 0.19. The key floor_z, which map_server ignores, is the height of the floor
/// [m].
[[nodiscard]] std::string map_yaml(const OccupancyGrid& grid, std::string_view image_name);

}  // namespace km
