#pragma once

#include <memory>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "runtime/dds/ros_subscription.hpp"

namespace km {

/// Live topics of ROS 2 as a recording without end, so that the code that plays recordings also
/// reads the topics of drivers. Not thread-safe, except for stop().
class LiveBag final : public BagReader {
 public:
  LiveBag(std::shared_ptr<const RosNetwork> network, std::vector<RosTopic> topics);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  /// Waits for a message. nullopt after stop(), or when the time of give_up_after() has passed.
  [[nodiscard]] std::optional<BagMessage> next() override;
  [[nodiscard]] BagReport report() const override;
  [[nodiscard]] bool is_live() const override { return true; }
  void stop() noexcept override { subscription_.stop(); }

  /// See RosSubscription::give_up_after().
  void give_up_after(double patience_s) { subscription_.give_up_after(patience_s); }

 private:
  RosSubscription subscription_;
  std::vector<BagChannel> channels_;
};

}  // namespace km
