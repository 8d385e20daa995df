#include "modules/ros_dds/node/live_sink.hpp"

namespace km {

std::size_t LiveSink::open(const PublishedTopic& topic) {
  publishers_.push_back(std::make_unique<RosPublisher>(
      network_, topic.name, topic.type, topic.is_state ? RosQos::kLatched : RosQos::kReliable,
      topic.depth));
  return publishers_.size() - 1;
}

}  // namespace km
