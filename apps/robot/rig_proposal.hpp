#pragma once

#include <string>
#include <vector>

#include "modules/recordings/bag_summary.hpp"
#include "modules/sensors/node/rig_file.hpp"

namespace km {

/// Topics that are most likely the cameras and the inertial sensor of a robot, judged by types,
/// rates and names. A person should check them: of several rigs in a recording the first one is
/// taken. Topics that are not found are empty. The calibration is unknown, except for topics of
/// CameraInfo.
[[nodiscard]] RigFile propose_rig(const std::vector<TopicSummary>& topics);

/// Reason why depth of a proposed RGB-D rig is not aligned with its camera, and the remedy; "" if
/// sizes and frames of the images are equal.
[[nodiscard]] std::string depth_problem(const std::vector<TopicSummary>& topics,
                                        const RigFile& rig);

}  // namespace km
