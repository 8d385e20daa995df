#pragma once

#include <vector>

#include "modules/recordings/bag_summary.hpp"
#include "modules/sensors/rig_file_codec.hpp"

namespace km {

/// The topics that are most likely a robot's cameras and inertial sensor, by their types, rates and
/// names, for a person to look at: of several rigs in a recording it is the one that comes first.
/// What is not found is empty; the calibration is not known, but topics of CameraInfo are.
[[nodiscard]] RigFile propose_rig(const std::vector<TopicSummary>& topics);

}  // namespace km
