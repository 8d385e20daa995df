#pragma once

#include <optional>

#include "apps/robot/mapping_plan.hpp"
#include "apps/robot/robot_config.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// How fast this computer can play a recording now, in seconds of the recording per second: for
/// --rate auto. Decodes the first seconds of `recording`, and runs odometry and the map on them, as
/// fast as they go. The robots of a team that start together measure together, so that the
/// processors that they share, and other programs that run, count. Takes at most 2 s. Nullopt if the
/// recording is too short to tell.
[[nodiscard]] std::optional<double> playing_speed(DatasetReader& recording,
                                                  const RobotConfig& config,
                                                  const std::optional<MappingPlan>& mapping);

/// The rate at which to play a recording that can be played at `speed`: 1, or less where that is
/// too fast; at least 0.1.
[[nodiscard]] double rate_for(std::optional<double> speed);

}  // namespace km
