#pragma once

#include <string>
#include <vector>

#include "apps/experiments/experiment_plan.hpp"

namespace km {

/// Appends `more` to `list`.
void append(std::vector<std::string>& list, const std::vector<std::string>& more);

/// True if EuRoC's own images are there of all robots.
[[nodiscard]] bool has_original_images(const WorldConfig& world, const ExperimentPaths& paths);

[[nodiscard]] std::string simulate_step_name(const WorldConfig& world);
[[nodiscard]] std::string team_step_name(const WorldConfig& world);

/// Recordings of a world, unless they are another's or EuRoC's own, and the team's run on them.
[[nodiscard]] std::vector<Step> world_steps(const WorldConfig& world, const ExperimentPaths& paths);

/// Pictures of the team's meshes before and after the correction.
[[nodiscard]] std::vector<Step> picture_steps(const WorldConfig& world,
                                              const ExperimentPaths& paths);

}  // namespace km
