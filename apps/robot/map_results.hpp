#pragma once

#include <filesystem>

#include "apps/result_writer.hpp"
#include "modules/core/occupancy_grid.hpp"
#include "modules/map_2d/map_2d_config.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/team_map/node/team_map_node.hpp"

namespace km {

/// Writes objects.json to `folder`.
void write_objects(const std::filesystem::path& folder, const ObjectList& objects,
                   const LabelPalette& palette, ResultWriter& results);

/// Writes a 2D map to `folder`, as Nav2's map_server reads it: the YAML file `name`, and its image.
void write_map_2d(const std::filesystem::path& folder, const char* name, const char* image,
                  const OccupancyGrid& map, ResultWriter& results);

/// Writes the fused mesh of the team, of the chunks that were received until now. If 2D maps are
/// enabled, also writes its 2D map.
void write_team_map(const std::filesystem::path& folder, const Map2dConfig& config,
                    const TeamMapNode& node, ResultWriter& results);

}  // namespace km
