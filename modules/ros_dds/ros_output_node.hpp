#pragma once

#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "modules/ros_dds/live_frames.hpp"
#include "modules/ros_dds/ros_publisher.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of what is told to viewers; they must outlive it.
struct RosOutputTopics {
  In<OdometryState> odometry;
  In<KeyframeOdometry> keyframes;
  In<Trajectory> trajectory;  ///< Of this robot.
};

/// Tells ROS' viewers and planners where a robot NAME is:
///   /NAME/odometry  nav_msgs/Odometry, NAME/odom -> NAME/base_link, for every image; no covariance
///   /NAME/pose      geometry_msgs/PoseStamped in `map`, for every image
///   /tf             map -> NAME/odom -> NAME/base_link, for every image
///   /NAME/path      nav_msgs/Path in `map`: the keyframes, whenever they are optimised; latched
/// `map` is the frame of the team, or of the robot alone as long as it is alone. base_link is the
/// inertial sensor's frame.
class RosOutputNode final : public Node {
 public:
  RosOutputNode(std::shared_ptr<const RosNetwork> network, const std::string& name,
                const RosOutputTopics& topics);
  ~RosOutputNode() override { stop(); }

  std::string_view name() const override { return "ros_output"; }
  void start() override { worker_.start(); }
  void stop() noexcept override { worker_.stop(); }
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

 private:
  using Input = std::variant<Topic<OdometryState>::Message, Topic<KeyframeOdometry>::Message,
                             Topic<Trajectory>::Message>;

  void step(const OdometryState& state);
  void step(const KeyframeOdometry& keyframe) { frames_.add(keyframe); }
  void step(const Trajectory& trajectory);

  std::string odom_, base_link_;
  RosPublisher odometry_, pose_, tf_, path_;
  LiveFrames frames_;
  Worker<Input> worker_;  // last member: stops first
};

}  // namespace km
