#include "modules/ros_dds/ros_output_node.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "modules/core/text_table.hpp"
#include "modules/ros_dds/mesh_cloud.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

constexpr const char* kMap = "map";
constexpr int kKept = 10;
constexpr double kLate_s = 2.0;
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
                             int mesh_points, Diagnose diagnose, const RosOutputTopics& topics)
    : name_(topic_name(name)),
      odom_(topic_name(name) + "/odom"),
      base_link_(topic_name(name) + "/base_link"),
      mesh_points_(static_cast<std::size_t>(mesh_points)),
      diagnose_(std::move(diagnose)),
      odometry_(network, '/' + topic_name(name) + "/odometry", RosOdometry::kType,
                RosQos::kReliable, kKept),
      pose_(network, '/' + topic_name(name) + "/pose", RosPoseStamped::kType, RosQos::kReliable,
            kKept),
      tf_(network, "/tf", RosTransforms::kType, RosQos::kReliable, 10 * kKept),
      path_(network, '/' + topic_name(name) + "/path", RosPath::kType, RosQos::kLatched, 1),
      mesh_(network, '/' + topic_name(name) + "/mesh", RosPointCloud::kType, RosQos::kLatched, 1),
      diagnostics_(network, "/diagnostics", RosDiagnostics::kType, RosQos::kReliable, kKept),
      worker_(
          kQueue, Overflow::kDropOldest,
          [this](const Input& input) {
            std::visit([this](const auto& message) { step(*message); }, input);
          },
          "ros_output"),
      clock_(
          std::chrono::seconds(1), [this] { worker_.post(std::make_shared<const Tick>()); },
          "ros_tick") {
  const auto post = [this](const auto& message) { worker_.post(message); };
  topics.odometry.subscribe(post);
  topics.keyframes.subscribe(post);
  topics.trajectory.subscribe(post);
}

void RosOutputNode::start() {
  worker_.start();
  clock_.start();
}

void RosOutputNode::stop() noexcept {
  clock_.stop();
  worker_.stop();
}

void RosOutputNode::step(const OdometryState& state) {
  frames_.add(state);
  ++poses_;
  stamp_ = state.stamp;
  speed_mps_ = state.v_odom.norm();
  told_s_ = steady_now_s();
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

void RosOutputNode::step(const LabelledMesh& mesh) {
  if (mesh_points_ == 0 || mesh.empty()) return;
  mesh_.publish(encode_ros(cloud_of(mesh, mesh_points_, {stamp_, kMap})));
}

RosDiagnosticStatus RosOutputNode::odometry_status() const {
  RosDiagnosticStatus status;
  status.name = name_ + ": odometry";
  status.hardware_id = name_;
  const double age_s = steady_now_s() - told_s_;
  if (poses_ == 0 || age_s > kLate_s) status.level = RosDiagnosticStatus::kWarn;
  status.message = poses_ == 0       ? "no image has a pose yet"
                   : age_s > kLate_s ? "no pose for " + fixed(age_s, 1) + " s"
                                     : "ok";
  status.values = {{"poses", std::to_string(poses_)},
                   {"keyframes", std::to_string(frames_.keyframe_stamps().size())},
                   {"stamp of the last [ns]", std::to_string(stamp_)},
                   {"speed [m/s]", fixed(speed_mps_, 3)}};
  return status;
}

void RosOutputNode::step(const Tick& /*tick*/) {
  RosDiagnostics diagnostics{{stamp_, ""}, diagnose_()};
  for (RosDiagnosticStatus& status : diagnostics.status) {
    status.name = name_ + ": " + status.name;
    status.hardware_id = name_;
  }
  diagnostics.status.insert(diagnostics.status.begin(), odometry_status());
  diagnostics_.publish(encode_ros(diagnostics));
}

}  // namespace km
