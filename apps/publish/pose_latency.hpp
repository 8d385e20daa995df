#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "modules/core/stamp.hpp"
#include "runtime/dds/ros_subscription.hpp"

namespace km {

/// Measures the time from an image to the robot's pose with the image's stamp: a nav_msgs/Odometry.
/// Thread-safe.
class PoseLatency {
 public:
  PoseLatency(std::shared_ptr<const RosNetwork> network, const std::string& topic);
  ~PoseLatency();

  /// Call before an image with this stamp is published.
  void sent(Stamp stamp);

  /// "/robot0/odometry: 318 of 333 images have a pose, after 12.3 ms (median), 20.1 ms (95 %), 3 of
  /// them after more than 50 ms".
  [[nodiscard]] std::string text() const;

 private:
  void listen();

  std::string topic_;
  RosSubscription subscription_;
  mutable std::mutex mutex_;        // guards the members below
  std::map<Stamp, double> sent_s_;  // by image without a pose: steady time of sent() [s]
  std::vector<double> latencies_s_;
  std::size_t sent_ = 0;
  std::jthread listener_;  // last member: ends first
};

}  // namespace km
