#pragma once

#include <optional>

#include "apps/robot/mapping_plan.hpp"
#include "apps/robot/robot_config.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// Speed at which this computer can play a recording now, in seconds of the recording per second,
/// for --rate auto. Decodes the first seconds of `recording`, and runs odometry and the map on them
/// as fast as possible. Robots of a team that start together also measure together, so the result
/// accounts for shared processors and other programs. Takes about 2 s at most. Nullopt if the
/// recording is too short to measure.
[[nodiscard]] std::optional<double> playing_speed(DatasetReader& recording,
                                                  const RobotConfig& config,
                                                  const std::optional<MappingPlan>& mapping);

/// Rate at which to play a recording that can be played at `speed`: 1, or less if that is too fast;
/// at least 0.1.
[[nodiscard]] double rate_for(std::optional<double> speed);

}  // namespace km
