#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/live_frames.hpp"
#include "runtime/dds/ros_publisher.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
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
///   /NAME/mesh      sensor_msgs/PointCloud2 in `map`: vertices, whenever they are corrected;
///   latched /diagnostics    diagnostic_msgs/DiagnosticArray, once a second: odometry, and what it
///   is given
/// `map` is the frame of the team, or of the robot alone as long as it is alone. base_link is the
/// inertial sensor's frame.
class RosOutputNode final : public Node {
 public:
  /// How the rest of the robot does, by the names of its parts. Called on the node's thread.
  using Diagnose = std::function<std::vector<RosDiagnosticStatus>()>;

  /// `mesh_points`: of a mesh, at most.
  RosOutputNode(std::shared_ptr<const RosNetwork> network, const std::string& name, int mesh_points,
                Diagnose diagnose, const RosOutputTopics& topics);
  ~RosOutputNode() override { stop(); }

  std::string_view name() const override { return "ros_output"; }
  /// A mesh in `map`, in place of the one before. Thread-safe; does not wait.
  void offer(std::shared_ptr<const LabelledMesh> mesh) { worker_.post(std::move(mesh)); }

  void start() override;
  void stop() noexcept override;
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

 private:
  struct Tick {};
  using Input = std::variant<std::shared_ptr<const Tick>, Topic<OdometryState>::Message,
                             Topic<KeyframeOdometry>::Message, Topic<Trajectory>::Message,
                             std::shared_ptr<const LabelledMesh>>;

  void step(const OdometryState& state);
  void step(const KeyframeOdometry& keyframe) { frames_.add(keyframe); }
  void step(const Trajectory& trajectory);
  void step(const LabelledMesh& mesh);
  void step(const Tick& tick);
  [[nodiscard]] RosDiagnosticStatus odometry_status() const;

  std::string name_, odom_, base_link_;
  std::size_t mesh_points_;
  Diagnose diagnose_;
  RosPublisher odometry_, pose_, tf_, path_, mesh_, diagnostics_;
  LiveFrames frames_;
  std::size_t poses_ = 0;
  Stamp stamp_ = 0;         // of the last pose
  double speed_mps_ = 0.0;  // then
  double told_s_ = 0.0;     // when it came; steady clock
  Worker<Input> worker_;
  Periodic clock_;  // last member: stops first
};

}  // namespace km
