#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/ros_dds/ros_network.hpp"

struct ddsi_serdata;

namespace km {

/// A topic to listen to.
struct RosTopic {
  std::string topic;  ///< "/camera/left/image_raw".
  std::string type;   ///< "sensor_msgs/msg/Image"
  RosQos qos = RosQos::kSensorData;
  int depth = 10;  ///< Messages kept until next() takes them; the oldest go.
};

/// Messages of ROS 2 as they come. What is silent for kSilence_s is named in the log. Not
/// thread-safe but for stop().
class RosSubscription final : public BagReader {
 public:
  static constexpr double kSilence_s = 5.0;

  RosSubscription(std::shared_ptr<const RosNetwork> network, std::vector<RosTopic> topics);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  /// Waits for a message. Nullopt after stop() and give_up_after().
  [[nodiscard]] std::optional<BagMessage> next() override;
  /// Messages that came too fast for DDS or for next().
  [[nodiscard]] BagReport report() const override;

  /// next() gives nothing once so much time has passed from now [s].
  void give_up_after(double patience_s);

  [[nodiscard]] bool is_live() const override { return true; }
  void stop() noexcept override;

 private:
  void take_from(std::size_t channel);
  void add(std::size_t channel, const ddsi_serdata& sample);
  void tell_silence();

  std::shared_ptr<const RosNetwork> network_;  // outlives what follows
  std::vector<BagChannel> channels_;
  std::vector<DdsEntity> topics_, readers_;
  DdsEntity waitset_, guard_;
  std::deque<BagMessage> taken_;
  std::vector<double> heard_s_;  // of each channel, when last; steady clock
  double told_s_ = 0.0;          // when silence was looked for
  double end_s_ = std::numeric_limits<double>::infinity();
  std::atomic<bool> stopped_ = false;
};

}  // namespace km
