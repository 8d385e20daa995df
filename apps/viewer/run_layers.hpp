#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// The objects, the 2D map and the slice of the distance field among the results of a robot, as
/// updates for viewers. `anchor`: robot whose odometry frame is the frame of the 2D map. Files that
/// are missing are left out, and `notes` names those that are damaged.
[[nodiscard]] std::vector<ViewContent> read_layers(const std::filesystem::path& folder,
                                                   RobotId robot, RobotId anchor,
                                                   std::vector<std::string>& notes);

/// The chunks of the fused mesh of the team among the results of a robot. Their key has another
/// robot id than `robot`, so that they replace no chunk of the mesh of the robot. Empty if the file
/// is missing or damaged, as above.
[[nodiscard]] std::vector<MeshChunk> read_team_mesh(const std::filesystem::path& folder,
                                                    RobotId robot, RobotId anchor,
                                                    std::vector<std::string>& notes);

}  // namespace km
