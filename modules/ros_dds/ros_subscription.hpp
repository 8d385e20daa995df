#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/ros_dds/ros_network.hpp"

namespace km {

/// A topic to listen to.
struct RosTopic {
  std::string topic;  ///< "/camera/left/image_raw".
  std::string type;   ///< "sensor_msgs/msg/Image"
  RosQos qos = RosQos::kSensorData;
  int depth = 10;  ///< Messages kept until next() takes them; the oldest go.
};

/// Messages of ROS 2 as they come, logged at the time of their arrival: a recording that has no
/// end. Not thread-safe but for stop() and lost().
class RosSubscription final : public BagReader {
 public:
  RosSubscription(std::shared_ptr<const RosNetwork> network, std::vector<RosTopic> topics);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  /// Waits for a message. Nullopt after stop().
  [[nodiscard]] std::optional<BagMessage> next() override;
  [[nodiscard]] BagReport report() const override { return {}; }

  /// Ends next(), now and later.
  void stop() noexcept;

  /// Messages that came too fast for DDS or for next(). Thread-safe.
  [[nodiscard]] std::size_t lost() const;

 private:
  void take_from(std::size_t channel);

  std::shared_ptr<const RosNetwork> network_;  // outlives what follows
  std::vector<BagChannel> channels_;
  std::vector<DdsEntity> topics_, readers_;
  DdsEntity waitset_, guard_;
  std::deque<BagMessage> taken_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace km
