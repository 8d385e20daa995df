#include "modules/sensors/sensor_kind.hpp"

#include "modules/sensors/ros_image.hpp"

namespace km {

bool is_of_kind(const BagChannel& channel, const SensorKind& kind) {
  return kind.type.empty() ? has_images(channel) : is_of_type(channel, kind.type);
}

std::vector<SensorTopic> sensor_topics(const SensorTopicNames& names) {
  std::vector<SensorTopic> topics;
  for (const SensorKind& kind : kSensorKinds) {
    const std::string& topic = names.*kind.topic;
    if (!topic.empty())
      topics.push_back({&kind, topic, kind.type.empty() ? type_of_images(topic) : kind.type});
  }
  return topics;
}

}  // namespace km
