#pragma once

#include <vector>

#include "modules/recordings/bag_summary.hpp"
#include "runtime/dds/ros_config.hpp"

namespace km {

/// Listens to ROS 2 for some seconds, and summarises the topics that programs publish there, of all
/// types that RosNetwork knows. Throws DdsError, and std::runtime_error with the domain and the
/// remedy if no program publishes images.
[[nodiscard]] std::vector<TopicSummary> summarise_live_topics(const RosConfig& config);

}  // namespace km
