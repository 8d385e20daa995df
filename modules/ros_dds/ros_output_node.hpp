#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "modules/core/stamped_pose.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/closure_lines.hpp"
#include "modules/ros_dds/live_frames.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "modules/ros_dds/surface_pieces.hpp"
#include "runtime/log_listener.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/token_bucket.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of what is told to viewers; they must outlive it.
struct RosOutputTopics {
  In<OdometryState> odometry;
  In<KeyframeOdometry> keyframes;
  In<Trajectory> trajectory;               ///< Of this robot.
  std::optional<In<SensorPacket>> images;  ///< Whose left ones are told, too.
};

/// What is told beside, and how.
struct RosOutputOptions {
  std::string robot = {};  ///< Its name.
  RobotId id = 0;
  /// Names of the robots: each has a frame NAME/map then. Without, the team's is `map` for all.
  std::function<std::string(RobotId)> name_of = {};
  int mesh_points = 0;  ///< Of a mesh, at most; 0: it is not told.
  int mesh_faces = 0;   ///< Likewise, in pieces: for those who are not to be held up.
  double mesh_bytes_per_s = std::numeric_limits<double>::infinity();  ///< Of these pieces.
  bool draws = false;  ///< The mesh's faces and the closures, for those who have time for them.
  bool logs = false;   ///< What is logged in this process.
  /// Paths, meshes and closures are told again once what they took last is paid at this rate.
  double state_bytes_per_s = std::numeric_limits<double>::infinity();
  std::size_t queue =
      1000;  ///< Inputs that may wait; then the oldest go: nobody waits for viewers.
};

/// Tells ROS' viewers and planners, or a file that they read, where a robot NAME is:
///   /NAME/odometry     nav_msgs/Odometry, NAME/odom -> NAME/base_link, for every image; no
///                      covariance
///   /NAME/pose         geometry_msgs/PoseStamped in `map`, for every image
///   /tf                map -> NAME/odom -> NAME/base_link, for every image
///   /NAME/path         nav_msgs/Path in `map`: the keyframes, whenever they are optimised; a state
///   /NAME/mesh         sensor_msgs/PointCloud2 in `map`: vertices, whenever they are corrected; a
///                      state
///   /diagnostics       diagnostic_msgs/DiagnosticArray, once a second: odometry, and what it is
///                      given
/// and on request:
///   /NAME/mesh_faces   visualization_msgs/Marker in `map`: the mesh's faces, in pieces (see
///                      SurfacePieces) or at once; a state
///   /NAME/closures     visualization_msgs/MarkerArray in `map`, see closure_lines()
///   /rosout            rcl_interfaces/Log
///   /NAME/left/image_raw/compressed  sensor_msgs/CompressedImage
/// `map` is the frame of the team, or of the robot alone as long as it is alone. Where every robot
/// has one of its own, as in files that are put together, /tf says once a second that it is that of
/// the robot in whose frame the team is. base_link is the inertial sensor's frame.
class RosOutputNode final : public Node {
 public:
  /// How the rest of the robot does, by the names of its parts; nullopt while it is silent: then
  /// nothing is told each second, and states that have changed at once. Called on the node's
  /// thread.
  using Diagnose = std::function<std::optional<std::vector<RosDiagnosticStatus>>()>;
  /// All closures of the robot; nullopt: as before. Called on the node's thread.
  using Closures = std::function<std::optional<std::vector<ToldClosure>>()>;

  RosOutputNode(std::string_view name, std::unique_ptr<RosSink> sink, RosOutputOptions options,
                Diagnose diagnose, Closures closures, const RosOutputTopics& topics);
  ~RosOutputNode() override { stop(); }

  std::string_view name() const override { return node_name_; }
  /// A mesh in `map`, in place of the one before. Thread-safe; does not wait.
  void offer(std::shared_ptr<const LabelledMesh> mesh) { worker_.post(std::move(mesh)); }

  void start() override;
  void stop() noexcept override;
  std::exception_ptr error() const override;
  std::vector<Heartbeat*> heartbeats() override;
  /// A disk may stand still for long, and nobody waits for it meanwhile.
  double step_limit_s() const override { return 300.0; }
  DurationHistogram timing() const override { return worker_.timing(); }

  /// Call after stop(): the states as they are at the end, `closures` (nullopt: as before) and as
  /// the path `poses`, in `map`, if there are any: those of all images; and files. Nothing follows.
  void finish(std::span<const StampedPose> poses, std::optional<std::vector<ToldClosure>> closures,
              const std::map<std::string, std::string>& files);

  /// Inputs and images for which there was no time.
  [[nodiscard]] std::size_t left_out() const;

 private:
  struct Tick {};
  // What of a mesh is to be told in pieces.
  struct CoarseMesh {
    std::shared_ptr<const LabelledMesh> mesh;
  };
  using Input =
      std::variant<std::shared_ptr<const Tick>, Topic<OdometryState>::Message,
                   Topic<KeyframeOdometry>::Message, Topic<Trajectory>::Message,
                   std::shared_ptr<const LabelledMesh>, CoarseMesh, std::shared_ptr<const RosLog>,
                   std::shared_ptr<const RosCompressedImage>>;
  using Image = std::shared_ptr<const StereoFrame>;
  using Encoded = std::variant<Image, std::shared_ptr<const LabelledMesh>>;
  // A state that is told when it has changed and its time has come.
  struct State {
    std::size_t topic = 0;
    bool changed = false;
    double due_s = 0.0;  // steady clock
  };

  void open_topics(bool has_images);
  void step(const std::shared_ptr<const Tick>& tick);
  void tell_diagnostics(std::vector<RosDiagnosticStatus> parts);
  void step(const Topic<OdometryState>::Message& state);
  void step(const Topic<KeyframeOdometry>::Message& keyframe);
  void step(const Topic<Trajectory>::Message& trajectory);
  void step(const std::shared_ptr<const LabelledMesh>& mesh);
  void step(const CoarseMesh& coarse);
  void step(const std::shared_ptr<const RosLog>& line);
  void step(const std::shared_ptr<const RosCompressedImage>& image);
  void encode(const Image& image);
  void encode(const std::shared_ptr<const LabelledMesh>& mesh);
  void listen(const log::Entry& entry);
  [[nodiscard]] std::string map_of(RobotId anchor) const;
  [[nodiscard]] std::optional<Stamp> time() const;
  [[nodiscard]] RosDiagnosticStatus odometry_status() const;
  [[nodiscard]] std::vector<StampedPose> keyframe_poses() const;
  template <typename Message>
  std::size_t tell(std::size_t topic, const Message& message);
  void tell_states(bool all);
  std::size_t tell_path(std::span<const StampedPose> poses);
  std::size_t tell_mesh();
  void tell_pieces();
  void tell_link();

  const std::string node_name_;
  const std::unique_ptr<RosSink> sink_;
  const RosOutputOptions options_;
  const std::string name_, odom_, base_link_, map_;
  const Diagnose diagnose_;
  const Closures closures_of_;
  std::size_t odometry_ = 0, pose_ = 0, tf_ = 0, diagnostics_ = 0, faces_ = 0, log_ = 0, image_ = 0;
  State path_, mesh_, closures_;
  LiveFrames frames_;
  std::size_t poses_ = 0;
  std::optional<Stamp> stamp_;   // of the last image or keyframe
  std::optional<Stamp> latest_;  // of the messages told: they never go back
  double speed_mps_ = 0.0;       // then
  double told_s_ = 0.0;          // when it came; steady clock
  Topic<Trajectory>::Message trajectory_ = std::make_shared<const Trajectory>();
  std::shared_ptr<const LabelledMesh> newest_mesh_;
  SurfacePieces pieces_;
  TokenBucket piece_bytes_;
  std::vector<ToldClosure> newest_closures_;
  Worker<Input> worker_;
  Worker<Encoded> encoder_;
  Periodic clock_;  // last member: stops first
};

}  // namespace km
