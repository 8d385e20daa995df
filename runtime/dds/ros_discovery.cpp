#include "runtime/dds/ros_discovery.hpp"

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

}  // namespace

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

void RosDiscovery::take() {
  std::array<void*, 1> sample{};
  std::array<dds_sample_info_t, 1> info{};
  while (dds_take(reader_.handle(), sample.data(), info.data(), 1, 1) == 1) {
    const auto& found = *static_cast<const dds_builtintopic_endpoint_t*>(sample[0]);
    // The sample of a publisher that has ended has no names.
    const std::string topic = info[0].valid_data ? found.topic_name : "";
    if (topic.starts_with("rt/"))
      publishers_.push_back({topic.substr(2), ros_type(found.type_name)});
    dds_return_loan(reader_.handle(), sample.data(), 1);
    sample = {};
  }
}

bool RosDiscovery::wait(double patience_s) {
  const std::size_t before = publishers_.size();
  const double end_s = steady_now_s() + patience_s;
  // Writers without a topic of ROS end the wait of DDS, too.
  for (double left_s = patience_s; left_s > 0.0; left_s = end_s - steady_now_s()) {
    check_dds(dds_waitset_wait(waitset_.handle(), nullptr, 0, nanoseconds(left_s)),
              "cannot wait for publications");
    take();
    if (publishers_.size() > before) return true;
  }
  return false;
}

const std::vector<TopicPublisher>& RosDiscovery::publishers() {
  take();
  return publishers_;
}

}  // namespace km
