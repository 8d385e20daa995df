#include "runtime/ros/ros_discovery.hpp"

#include <algorithm>
#include <array>

#include "modules/core/stamp.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

// Name in ROS of a type in DDS: "sensor_msgs/msg/Imu" for "sensor_msgs::msg::dds_::Imu_".
std::string ros_type(std::string name) {
  const auto replace = [&name](const std::string& from, const std::string& to) {
    for (std::size_t at = name.find(from); at != name.npos; at = name.find(from, at + to.size()))
      name.replace(at, from.size(), to);
  };
  replace("::dds_::", "/");
  replace("::", "/");
  if (name.ends_with('_')) name.pop_back();
  return name;
}

// "sensor_msgs/Imu", as in ROS 1, for "sensor_msgs/msg/Imu" too.
std::string plain(const std::string& type) {
  return type.substr(0, type.find('/')) + '/' + type.substr(type.rfind('/') + 1);
}

// Images, compressed or not, are of one kind.
std::string kind_of(const std::string& type) {
  const std::string name = plain(type);
  return name == "sensor_msgs/CompressedImage" ? "sensor_msgs/Image" : name;
}

}  // namespace

Silence why_silent(const std::string& topic, const std::string& type,
                   const std::function<bool(const std::string&)>& is_named,
                   std::span<const TopicPublisher> publishers) {
  const auto same = std::ranges::find(publishers, topic, &TopicPublisher::topic);
  if (same != publishers.end() && plain(same->type) != plain(type))
    return {"other_type", "its publisher sends " + same->type,
            "name a topic of " + type + ": those of compressed images end with /compressed"};
  if (same != publishers.end())
    return {"silent", "a program publishes it, but no message arrives",
            "check that the driver has data; large images need a net.core.rmem_max of several "
            "megabytes"};
  // Length of the common beginning, plus 1; 0 for messages of another kind.
  const auto alike = [&](const TopicPublisher& other) {
    const auto [end, rest] = std::ranges::mismatch(topic, other.topic);
    return kind_of(other.type) == kind_of(type) && !is_named(other.topic)
               ? 1 + (end - topic.begin())
               : 0;
  };
  const auto similar = std::ranges::max_element(publishers, {}, alike);
  if (similar != publishers.end() && alike(*similar) > 0)
    return {
        "similar_name",
        "no program publishes it, but one publishes " + similar->topic + " (" + similar->type + ')',
        "name in the rig file what the driver publishes"};
  return {"silent", "no program publishes it",
          "start the driver; check ROS_DOMAIN_ID (--set ros.domain=N) and ros.interface"};
}

RosDiscovery::RosDiscovery(const RosNetwork& network)
    : reader_(dds_create_reader(network.participant(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr,
                                nullptr),
              "reader of the publications"),
      waitset_(dds_create_waitset(network.participant()), "waitset") {
  check_dds(dds_set_status_mask(reader_.handle(), DDS_DATA_AVAILABLE_STATUS),
            "cannot wait for publications");
  check_dds(dds_waitset_attach(waitset_.handle(), reader_.handle(), 0),
            "cannot wait for publications");
}

bool RosDiscovery::take() {
  bool any_new = false;
  std::array<void*, 1> sample{};
  std::array<dds_sample_info_t, 1> info{};
  while (dds_take(reader_.handle(), sample.data(), info.data(), 1, 1) == 1) {
    const auto& found = *static_cast<const dds_builtintopic_endpoint_t*>(sample[0]);
    const std::uint64_t instance = info[0].instance_handle;
    std::erase_if(publishers_, [&](const auto& known) { return known.instance == instance; });
    // The sample of a publisher that has ended has no names.
    const bool has_ended = !info[0].valid_data || info[0].instance_state != DDS_IST_ALIVE;
    const std::string topic = has_ended ? "" : found.topic_name;
    if (topic.starts_with("rt/")) {
      publishers_.push_back({topic.substr(2), ros_type(found.type_name), instance});
      any_new = true;
    }
    dds_return_loan(reader_.handle(), sample.data(), 1);
    sample = {};
  }
  return any_new;
}

bool RosDiscovery::wait(double patience_s) {
  const double end_s = steady_now_s() + patience_s;
  // Writers without a topic of ROS end the wait of DDS, too.
  for (double left_s = patience_s; left_s > 0.0; left_s = end_s - steady_now_s()) {
    check_dds(dds_waitset_wait(waitset_.handle(), nullptr, 0, nanoseconds(left_s)),
              "cannot wait for publications");
    if (take()) return true;
  }
  return false;
}

const std::vector<TopicPublisher>& RosDiscovery::publishers() {
  (void)take();
  return publishers_;
}

}  // namespace km
