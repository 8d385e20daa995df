#pragma once

#include <string>
#include <vector>

#include "apps/lab/simulate/robot_scenario.hpp"
#include "apps/lab/simulation/dataset/dataset_record.hpp"

namespace km {

/// team.yaml: the robots, their true poses and the true mesh, for kimera_multi_team. Robots with
/// depth build a map, with labels if those were recorded.
[[nodiscard]] std::string team_yaml(const SimulationOptions& options);

/// README.md: parameters and content of the folder.
[[nodiscard]] std::string dataset_readme(const SimulationOptions& options,
                                         const DatasetRecord& record, const World& world,
                                         const std::vector<RobotScenario>& robots);

}  // namespace km
