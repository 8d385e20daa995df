#include "apps/robot/live_summary.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/ros_dds/node/live_bag.hpp"
#include "modules/sensors/ros_image.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/ros_discovery.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr double kDiscovery_s = 10.0;  // longest time until a program publishes images
constexpr double kQuiet_s = 1.0;       // discovery is complete after this time without news
constexpr double kListen_s = 10.0;     // longest time to listen
constexpr std::size_t kEnough = 30;    // messages of each sensor
constexpr int kLiveMessages = 4000;    // kept messages of a topic

bool is_sensor(const BagChannel& channel) {
  return has_images(channel) || is_of_type(channel, RosImu::kType) ||
         is_of_type(channel, RosCameraInfo::kType);
}

// The live topics until each sensor has given enough messages.
class FirstMessages final : public BagReader {
 public:
  explicit FirstMessages(LiveBag& bag) : bag_(bag), counts_(bag.channels().size()) {}

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return bag_.channels(); }
  [[nodiscard]] std::optional<BagMessage> next() override {
    if (has_enough()) return std::nullopt;
    auto message = bag_.next();
    if (message) ++counts_[message->channel];
    return message;
  }
  [[nodiscard]] BagReport report() const override { return bag_.report(); }
  [[nodiscard]] bool is_live() const override { return true; }

 private:
  [[nodiscard]] bool has_enough() const {
    for (std::size_t k = 0; k < counts_.size(); ++k)
      if (is_sensor(channels()[k]) && counts_[k] < kEnough) return false;
    return true;
  }

  LiveBag& bag_;
  std::vector<std::size_t> counts_;
};

std::vector<RosTopic> topics_of(const std::vector<TopicPublisher>& publishers) {
  const auto known = known_ros_types();
  std::vector<RosTopic> topics;
  for (const TopicPublisher& publisher : publishers) {
    const bool is_new = std::ranges::count(topics, publisher.topic, &RosTopic::topic) == 0;
    if (is_new && std::ranges::count(known, publisher.type) > 0)
      topics.push_back({publisher.topic, publisher.type, RosQos::kSensorData, kLiveMessages});
  }
  return topics;
}

}  // namespace

std::vector<TopicSummary> summarise_live_topics(const RosConfig& config) {
  const auto network = std::make_shared<const RosNetwork>(config);
  const std::string place =
      "ROS domain " + std::to_string(config.domain) + ", interface " + network->interface();
  log::info("inspect") << "listening on " << place;
  RosDiscovery discovery(*network);
  const auto has_publishers_of_images = [&discovery] {
    return std::ranges::any_of(discovery.publishers(), [](const TopicPublisher& publisher) {
      return has_images({publisher.topic, publisher.type, "cdr", 0});
    });
  };
  const double end_s = steady_now_s() + kDiscovery_s;
  while (discovery.wait(kQuiet_s) || !has_publishers_of_images())
    if (steady_now_s() > end_s && !has_publishers_of_images())
      throw std::runtime_error("no program publishes images on " + place +
                               ": start the drivers; --set ros.domain=N is their ROS_DOMAIN_ID, "
                               "--set ros.interface=lo is for ROS_LOCALHOST_ONLY=1");
  LiveBag bag(network, topics_of(discovery.publishers()));
  bag.give_up_after(kListen_s);
  FirstMessages messages(bag);
  return summarise_topics(messages);
}

}  // namespace km
