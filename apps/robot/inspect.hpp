#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/recordings/bag_summary.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "runtime/ros/ros_config.hpp"

namespace km {

/// Description of a recording for people: a bag of ROS 1 or 2, an MCAP file, or a EuRoC folder. One
/// table shows how regular the messages of each topic are, another how well the stamps of camera
/// pairs agree. Skipped parts follow. Throws InputFileError with one line (file and place) if
/// `path` is no recording.
[[nodiscard]] std::string inspect_recording(const std::filesystem::path& path);

/// Description of a bag, as above. Also writes `rig`, a rig file (see RigFile) with the topics that
/// are most likely the sensors of the bag. Throws InputFileError also if `rig` exists already, and
/// the exceptions of write_file().
[[nodiscard]] std::string inspect_recording(const std::filesystem::path& path,
                                            const std::filesystem::path& rig);

/// Description of the topics that programs publish on ROS 2 now, as above. If `rig` is not empty,
/// also writes the rig file. Further errors as for summarise_live_topics().
[[nodiscard]] std::string inspect_live(const RosConfig& config, const std::filesystem::path& rig);

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
