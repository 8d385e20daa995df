#include "modules/ros_dds/ros_output_node.hpp"

#include <utility>

#include "modules/recordings/ros_messages.hpp"

namespace km {
namespace {

constexpr const char* kMap = "map";
constexpr int kKept = 10;
constexpr std::size_t kQueue = 1000;  // nobody waits for viewers: the oldest go

RosPose message_of(const SE3& T) {
  return {T.translation(), Eigen::Quaterniond(T.linear())};
}

// Names of ROS' topics have letters, digits and underscores.
std::string topic_name(std::string name) {
  for (char& c : name) {
    const bool is_fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!is_fine) c = '_';
  }
  return name;
}

}  // namespace

RosOutputNode::RosOutputNode(std::shared_ptr<const RosNetwork> network, const std::string& name,
                             const RosOutputTopics& topics)
    : odom_(topic_name(name) + "/odom"),
      base_link_(topic_name(name) + "/base_link"),
      odometry_(network, '/' + topic_name(name) + "/odometry", RosOdometry::kType,
                RosQos::kReliable, kKept),
      pose_(network, '/' + topic_name(name) + "/pose", RosPoseStamped::kType, RosQos::kReliable,
            kKept),
      tf_(network, "/tf", RosTransforms::kType, RosQos::kReliable, 10 * kKept),
      path_(network, '/' + topic_name(name) + "/path", RosPath::kType, RosQos::kLatched, 1),
      worker_(
          kQueue, Overflow::kDropOldest,
          [this](const Input& input) {
            std::visit([this](const auto& message) { step(*message); }, input);
          },
          "ros_output") {
  const auto post = [this](const auto& message) { worker_.post(message); };
  topics.odometry.subscribe(post);
  topics.keyframes.subscribe(post);
  topics.trajectory.subscribe(post);
}

void RosOutputNode::step(const OdometryState& state) {
  frames_.add(state);
  RosOdometry odometry;
  odometry.header = {state.stamp, odom_};
  odometry.child_frame = base_link_;
  odometry.pose = message_of(state.T_odom_body);
  odometry.linear_velocity = state.T_odom_body.linear().transpose() * state.v_odom;
  odometry.angular_velocity = frames_.angular_rate();
  odometry_.publish(encode_ros(odometry));
  pose_.publish(encode_ros(
      RosPoseStamped{{state.stamp, kMap}, message_of(frames_.T_map_odom() * state.T_odom_body)}));
  tf_.publish(encode_ros(
      RosTransforms{{{{state.stamp, kMap}, odom_, message_of(frames_.T_map_odom())},
                     {{state.stamp, odom_}, base_link_, message_of(state.T_odom_body)}}}));
}

void RosOutputNode::step(const Trajectory& trajectory) {
  frames_.add(trajectory);
  RosPath path;
  const auto& stamps = frames_.keyframe_stamps();
  for (std::size_t k = 0; k < std::min(stamps.size(), trajectory.T_world_kf.size()); ++k)
    path.poses.push_back({{stamps[k], kMap}, message_of(trajectory.T_world_kf[k])});
  path.header = {path.poses.empty() ? 0 : path.poses.back().header.stamp, kMap};
  path_.publish(encode_ros(path));
}

}  // namespace km
