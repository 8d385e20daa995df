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

/// effects.yaml: all effects with their values, as sections of a file of options.
[[nodiscard]] std::string effects_yaml(const Effects& effects);

/// errors.yaml: errors of the robot's inertial sensor and clocks.
[[nodiscard]] std::string true_errors_yaml(const RobotScenario& robot);

/// image_times.csv: the stamp of each image, and its true time [ns].
[[nodiscard]] std::string true_times_csv(const RobotScenario& robot);

/// traffic.csv: poses of all that moves besides robots, with class and size, at the true times of
/// the first robot's images.
[[nodiscard]] std::string traffic_csv(const Traffic& traffic,
                                      const std::vector<RobotScenario>& robots);

}  // namespace km
