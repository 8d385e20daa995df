#pragma once

#include "apps/doctor/examine_recording.hpp"
#include "modules/sensors/rig_completion.hpp"
#include "runtime/dds/ros_config.hpp"
#include "runtime/dds/ros_discovery.hpp"

namespace km {

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

}  // namespace km
