#include "apps/doctor/examine_live.hpp"

#include <algorithm>
#include <memory>

#include "apps/robot/robot_input.hpp"
#include "modules/core/text_table.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/ros_subscription.hpp"

namespace km {
namespace {

std::string last_name(const std::string& topic) {
  return topic.substr(topic.rfind('/') + 1);
}

// Name of a type in ROS 1: "sensor_msgs/Imu" for "sensor_msgs/msg/Imu" too.
std::string plain(const std::string& type) {
  return type.substr(0, type.find('/')) + '/' + last_name(type);
}

Finding silent(const ListenedTopic& wanted, const std::vector<ListenedTopic>& topics,
               const std::vector<TopicPublisher>& publishers) {
  Finding finding{.id = "live.silent", .severity = Severity::kError};
  const auto same = std::ranges::find(publishers, wanted.topic, &TopicPublisher::topic);
  // Similarity of a topic to the wanted topic: length of the common prefix, plus 1. It is 0 for
  // another type, and for a topic that the rig file names.
  const auto alike = [&](const TopicPublisher& other) {
    if (std::ranges::find(topics, other.topic, &ListenedTopic::topic) != topics.end()) return 0L;
    const auto [end, rest] = std::ranges::mismatch(wanted.topic, other.topic);
    return plain(other.type) == plain(wanted.type) ? 1 + (end - wanted.topic.begin()) : 0;
  };
  const auto similar = std::ranges::max_element(publishers, {}, alike);
  finding.what = "no message on " + wanted.topic + " (" + wanted.type + ')';
  finding.means = "the robot waits for this topic";
  if (same != publishers.end() && plain(same->type) != plain(wanted.type)) {
    finding.id = "live.other_type";
    finding.what += ": its publisher sends " + same->type;
    finding.to_do =
        "name a topic of " + wanted.type + ": those of compressed images end with /compressed";
  } else if (same != publishers.end()) {
    finding.what += ", although a program publishes it";
    finding.to_do =
        "check that the driver has data; large images need a net.core.rmem_max of several "
        "megabytes";
  } else if (similar != publishers.end() && alike(*similar) > 0) {
    finding.id = "live.similar_name";
    finding.what += ": no program publishes it, but " + similar->topic + " is of that type";
    finding.to_do = "name the topic in the rig file as the driver does";
  } else {
    finding.what += ": no program publishes it";
    finding.to_do = "start the driver; check ROS_DOMAIN_ID (ros.domain) and ros.interface";
  }
  return finding;
}

}  // namespace

Examination examine_topics(const std::vector<ListenedTopic>& topics,
                           const std::vector<TopicPublisher>& publishers, double listened_s,
                           int domain) {
  Examination result;
  for (const ListenedTopic& topic : topics)
    result.figures.push_back({topic.topic, std::to_string(topic.messages) + " messages of " +
                                               topic.type + " in " + fixed(listened_s, 1) + " s"});
  const auto is_silent = [](const ListenedTopic& topic) { return topic.messages == 0; };
  if (publishers.empty() && std::ranges::all_of(topics, is_silent)) {
    result.findings.push_back(
        {.id = "live.no_publishers",
         .severity = Severity::kError,
         .what = "no program publishes a topic on domain " + std::to_string(domain) + " of ROS",
         .means = "no driver runs, or the drivers use another domain or interface",
         .to_do = "set ros.domain to the ROS_DOMAIN_ID of the drivers; check ros.interface and "
                  "ros.peers"});
    return result;
  }
  for (const ListenedTopic& topic : topics)
    if (is_silent(topic)) result.findings.push_back(silent(topic, topics, publishers));
  return result;
}

Examination examine_live_topics(const SensorTopicNames& names, const RosConfig& config,
                                double listen_s, const ReportProgress& report_progress) {
  const auto network = std::make_shared<const RosNetwork>(config);
  RosDiscovery discovery(*network);
  RosSubscription subscription(network, live_topics(names));
  std::vector<ListenedTopic> topics;
  for (const RosTopic& topic : subscription.topics()) topics.push_back({topic.topic, topic.type});
  const double start_s = steady_now_s();
  subscription.give_up_after(listen_s);
  while (const auto message = subscription.next()) {
    report_progress("listening", (steady_now_s() - start_s) / listen_s);
    ++topics[message->topic].messages;
  }
  return examine_topics(topics, discovery.publishers(), listen_s, config.domain);
}

}  // namespace km
