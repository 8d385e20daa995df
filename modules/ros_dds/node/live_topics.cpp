#include "modules/ros_dds/node/live_topics.hpp"

#include <utility>

namespace km {

LiveBag::LiveBag(std::shared_ptr<const RosNetwork> network, std::vector<RosTopic> topics)
    : subscription_(std::move(network), std::move(topics)) {
  for (const RosTopic& topic : subscription_.topics())
    channels_.push_back({topic.topic, topic.type, "cdr", 0});
}

std::optional<BagMessage> LiveBag::next() {
  auto message = subscription_.next();
  if (!message) return std::nullopt;
  return BagMessage{message->topic, message->arrival, std::move(message->bytes)};
}

BagReport LiveBag::report() const {
  BagReport report;
  for (std::size_t topic = 0; topic < channels_.size(); ++topic)
    if (const auto lost = subscription_.lost(topic); lost > 0)
      report.add(BagFault::kLost, channels_[topic].topic, lost);
  return report;
}

}  // namespace km
