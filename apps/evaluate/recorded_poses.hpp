#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/stamped_pose.hpp"

namespace km {

/// A topic of a record, "team.mcap:/alice/path" on the command line.
struct RecordTopic {
  std::filesystem::path file;
  std::string topic;

  /// Name of the robot: "alice".
  [[nodiscard]] std::string robot() const { return topic.substr(1, topic.find('/', 1) - 1); }
};

/// nullopt for a text without this form.
[[nodiscard]] std::optional<RecordTopic> split_record(const std::filesystem::path& input);

/// Inputs with each MCAP file replaced by its trajectories: FILE:/NAME/path of every robot, or else
/// FILE:/NAME/odometry. Throws InputFileError for a record that cannot be read or has none.
[[nodiscard]] std::vector<std::filesystem::path> expand_records(
    const std::vector<std::filesystem::path>& inputs);

/// Poses in order of time, from a topic of a record, from the only trajectory of a record, or as
/// read_trajectory() reads them. The last nav_msgs/Path counts; nav_msgs/Odometry and
/// geometry_msgs/PoseStamped give one pose each. Throws InputFileError.
[[nodiscard]] std::vector<StampedPose> read_estimate(const std::filesystem::path& input);

}  // namespace km
