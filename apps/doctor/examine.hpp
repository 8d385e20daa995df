#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/robot/robot_config.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/rig_completion.hpp"
#include "runtime/ros/ros_config.hpp"
#include "runtime/ros/ros_discovery.hpp"

namespace km {

/// Called with the finished share of the work, 0 to 1; always 0 if the share is unknown.
using ReportProgress = std::function<void(std::string_view stage, double share)>;

/// Findings on a recording, or on the live sensors of a rig file: see examine_sensors.hpp.
/// `options` names the input and the window, as for a robot. Live sensors are examined for
/// `live_s`. An input that cannot be opened is the finding recording.refused. The vocabulary of
/// `config` is also compared with the images (vocabulary.coverage).
[[nodiscard]] Examination examine_recording(const RobotOptions& options, const RobotConfig& config,
                                            double live_s, const ReportProgress& report_progress);

/// A topic that a rig file names, and the number of messages received from it.
struct ListenedTopic {
  std::string topic, type;
  std::size_t messages = 0;
};

/// Compares the topics of a rig file with the publishers. Ids: `live.silent`, `live.other_type`,
/// `live.similar_name`, `live.no_publishers`.
[[nodiscard]] Examination examine_topics(const std::vector<ListenedTopic>& topics,
                                         const std::vector<TopicPublisher>& publishers,
                                         double listened_s, int domain);

/// Listens to the sensors' topics of a rig for `listen_s` [s], and to the announcements of
/// publishers.
[[nodiscard]] Examination examine_live_topics(const SensorTopicNames& names,
                                              const RosConfig& config, double listen_s,
                                              const ReportProgress& report_progress);

/// True for the folder of a robot's results, and for a folder with the results of a team.
[[nodiscard]] bool are_results(const std::filesystem::path& folder);

/// Findings on the runs in `folder`, from summary.json, loop_closures.csv and config.yaml of each
/// robot. Ids: those of findings_of(), and `results.<file>` for a missing or invalid file. Throws
/// std::runtime_error for an unreadable summary.json.
[[nodiscard]] Examination examine_results(const std::filesystem::path& folder);

}  // namespace km
