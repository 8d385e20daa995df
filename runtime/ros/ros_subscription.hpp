#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/stamp.hpp"
#include "runtime/ros/ros_discovery.hpp"

struct ddsi_serdata;

namespace km {

/// A topic to listen to.
struct RosTopic {
  std::string topic;  ///< "/camera/left/image_raw".
  std::string type;   ///< "sensor_msgs/msg/Image"
  RosQos qos = RosQos::kSensorData;
  int depth = 10;  ///< Messages kept for next(); then the oldest are dropped.
};

/// A serialised message: CDR with its encapsulation header.
struct RosMessage {
  std::size_t topic = 0;  ///< Index into RosSubscription::topics().
  Stamp arrival = 0;      ///< System clock [ns].
  std::vector<std::uint8_t> bytes;
};

/// Messages of ROS 2 in the order of arrival. From the first next() on, topics that are silent for
/// kSilence_s are named in the log, with the reason. Not thread-safe, except for stop().
class RosSubscription {
 public:
  static constexpr double kSilence_s = 5.0;

  RosSubscription(std::shared_ptr<const RosNetwork> network, std::vector<RosTopic> topics);

  [[nodiscard]] const std::vector<RosTopic>& topics() const { return topics_; }
  /// Waits for a message. nullopt after stop(), or when the time of give_up_after() has passed.
  [[nodiscard]] std::optional<RosMessage> next();
  /// Messages of a topic lost since the first next(), because they arrived too fast.
  [[nodiscard]] std::uint64_t lost(std::size_t topic) const;

  /// Ends next() when this time [s] has passed from now.
  void give_up_after(double patience_s);

  /// Ends next(), now and later. Thread-safe.
  void stop() noexcept;

 private:
  void begin();
  void take_from(std::size_t topic);
  void add(std::size_t topic, const ddsi_serdata& sample);
  void report_silence();
  [[nodiscard]] std::uint64_t lost_ever(std::size_t topic) const;

  std::shared_ptr<const RosNetwork> network_;  // outlives the members below
  std::vector<RosTopic> topics_;
  std::vector<DdsEntity> dds_topics_, readers_;
  RosDiscovery discovery_;
  DdsEntity waitset_, guard_;
  std::deque<RosMessage> taken_;
  std::vector<std::uint64_t> lost_before_;  // by topic: lost messages before the first next()
  std::vector<double> last_received_s_;  // by topic: time of the last message by the steady clock;
                                         // empty before next()
  double silence_checked_s_ = 0.0;       // time of the last check for silence
  double end_s_ = std::numeric_limits<double>::infinity();
  std::atomic<bool> stopped_ = false;
};

}  // namespace km
