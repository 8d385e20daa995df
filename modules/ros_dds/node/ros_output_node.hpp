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

#include "modules/core/data/live_frames.hpp"
#include "modules/core/data/stamped_pose.hpp"
#include "modules/core/map/occupancy_grid.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/drawings.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "runtime/log.hpp"
#include "runtime/token_bucket.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels with the inputs of the node; they must outlive it.
struct RosOutputTopics {
  In<OdometryState> odometry;
  In<KeyframeOdometry> keyframes;
  In<Trajectory> trajectory;               ///< Trajectory of this robot.
  std::optional<In<SensorPacket>> images;  ///< Source of the published left images, if any.
};

/// Selection of optional outputs.
struct RosOutputOptions {
  std::string robot = {};  ///< Name of the robot.
  RobotId id = 0;
  /// Returns the name of a robot. If set, each robot has a frame NAME/map of its own. Otherwise
  /// `map` is the frame of the team for all robots.
  std::function<std::string(RobotId)> name_of = {};
  int mesh_points = 0;  ///< Maximum number of points of a mesh; 0: no points are published.
  int mesh_faces = 0;   ///< Maximum number of faces, published in pieces so that slow viewers are
                        ///< not blocked.
  double mesh_bytes_per_s = std::numeric_limits<double>::infinity();  ///< Maximum rate of the
                                                                      ///< pieces of faces.
  /// Publish nothing in `map` before the first trajectory: the robot does not know where it is.
  bool awaits_trajectory = false;
  /// Classes of the objects that are published; nullopt: no objects are published.
  std::optional<LabelPalette> objects = std::nullopt;
  bool draws = false;  ///< Publish faces of the mesh and closures as markers.
  bool logs = false;   ///< Publish the log of this process.
  /// Maximum rate of each of the topics `path`, `mesh`, `map_2d`, `closures` and `objects`.
  double state_bytes_per_s = std::numeric_limits<double>::infinity();
  /// Maximum number of waiting inputs; beyond it the oldest are dropped, so that no node waits for
  /// viewers.
  std::size_t queue = 1000;
};

/// A mesh to be published in pieces.
struct RosCoarseMesh {
  std::shared_ptr<const LabelledMesh> mesh;
};
using RosOutputInput =
    std::variant<Tick, Topic<OdometryState>::Message, Topic<KeyframeOdometry>::Message,
                 Topic<Trajectory>::Message, std::shared_ptr<const LabelledMesh>, RosCoarseMesh,
                 Topic<ObjectList>::Message, std::shared_ptr<const OccupancyGrid>,
                 std::shared_ptr<const RosLog>, std::shared_ptr<const RosCompressedImage>>;

/// Publishes the state of a robot NAME to ROS viewers and planners, or into a file that they read:
///   /NAME/odometry     nav_msgs/Odometry, NAME/odom -> NAME/base_link, for every image; no
///                      covariance
///   /NAME/pose         geometry_msgs/PoseWithCovarianceStamped in `map`, for every image; its
///                      covariance is relative to the origin of `map`, see
///                      LiveFrames::T_map_body()
///   /tf                map -> NAME/odom -> NAME/base_link, for every image
///   /NAME/path         nav_msgs/Path in `map`: the keyframes, whenever they are optimised
///   /NAME/mesh         sensor_msgs/PointCloud2 in `map`: vertices, whenever they are corrected
///   /NAME/map_2d       nav_msgs/OccupancyGrid in `map`, whenever it is made
///   /diagnostics       diagnostic_msgs/DiagnosticArray, once a second: odometry, and what
///                      Diagnose returns
/// and on request:
///   /NAME/mesh_faces   visualization_msgs/Marker in `map`: the mesh's faces, in pieces (see
///                      SurfacePieces) or at once
///   /NAME/closures     visualization_msgs/MarkerArray in `map`, see closure_lines()
///   /NAME/objects      visualization_msgs/MarkerArray in `map`, see object_markers()
///   /rosout            rcl_interfaces/Log
///   /NAME/left/image_raw/compressed  sensor_msgs/CompressedImage
/// `map` is the frame of the team, or of the robot before it joins others. In files that are merged
/// later, every robot has a map frame of its own (see RosOutputOptions::name_of). Then /tf contains
/// once a second the transform from the frame of the team to this map frame. base_link is the frame
/// of the inertial sensor.
class RosOutputNode final : public WorkerNode<RosOutputInput> {
 public:
  /// Returns the diagnostics of the other parts of the robot, by name. Called on the node's thread.
  using Diagnose = std::function<std::vector<RosDiagnosticStatus>()>;
  /// Returns all closures of the robot, or nullopt if they are unchanged. Called on the node's
  /// thread.
  using Closures = std::function<std::optional<std::vector<PublishedClosure>>()>;

  RosOutputNode(std::string_view name, std::unique_ptr<RosSink> sink, RosOutputOptions options,
                Diagnose diagnose, Closures closures, const RosOutputTopics& topics);
  ~RosOutputNode() override { stop(); }

  /// Replaces the mesh by `mesh`, whose frame is `map`. Thread-safe; does not wait.
  void offer(std::shared_ptr<const LabelledMesh> mesh) { post(std::move(mesh)); }
  /// Replaces the objects by `objects`, whose frame is `map`. Thread-safe; does not wait.
  void offer(std::shared_ptr<const ObjectList> objects) { post(std::move(objects)); }
  /// Replaces the 2D map, whose frame is `map`. Thread-safe; does not wait.
  void offer(std::shared_ptr<const OccupancyGrid> grid) { post(std::move(grid)); }

  std::exception_ptr error() const override {
    return first_of({WorkerNode::error(), encoder_.error()});
  }
  std::vector<Heartbeat*> heartbeats() override {
    return {WorkerNode::heartbeats().front(), &encoder_.heartbeat()};
  }

  /// Publishes the final path, mesh, closures and files. Call it after stop(), as the last call.
  /// `closures` is nullopt if they are unchanged. `poses`, in `map`, are the poses of all images
  /// and become the path unless empty.
  void finish(std::span<const StampedPose> poses,
              std::optional<std::vector<PublishedClosure>> closures,
              const std::map<std::string, std::string>& files);

  /// Number of inputs and images that were dropped because the node was too slow.
  [[nodiscard]] std::size_t dropped() const;

 private:
  using Image = std::shared_ptr<const StereoFrame>;
  using Encoded = std::variant<Image, std::shared_ptr<const LabelledMesh>>;
  // Topic whose message replaces the former one: path, mesh, 2D map, closures or objects. A changed
  // message is published at `due_s`, which limits the rate (RosOutputOptions::state_bytes_per_s).
  struct LatestTopic {
    std::size_t topic = 0;
    bool changed = false;
    double due_s = 0.0;  // steady clock
  };

  void open_topics(bool has_images);
  void handle(const Input& input) override {
    std::visit([this](const auto& message) { step(message); }, input);
  }
  void start_sources() override;
  void stop_sources() noexcept override;
  void step(const Tick& tick);
  void publish_diagnostics(std::vector<RosDiagnosticStatus> parts);
  void step(const Topic<OdometryState>::Message& state);
  void step(const Topic<KeyframeOdometry>::Message& keyframe);
  void step(const Topic<Trajectory>::Message& trajectory);
  void step(const std::shared_ptr<const LabelledMesh>& mesh);
  void step(const RosCoarseMesh& coarse);
  void step(const Topic<ObjectList>::Message& objects);
  void step(const std::shared_ptr<const OccupancyGrid>& grid);
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
  std::size_t publish(std::size_t topic, const Message& message);
  void publish_latest(bool all);
  std::size_t publish_path(std::span<const StampedPose> poses);
  std::size_t publish_mesh();
  void publish_pieces();
  void publish_team_frame();

  const std::unique_ptr<RosSink> sink_;
  const RosOutputOptions options_;
  const std::string name_, odom_, base_link_, map_;
  const Diagnose diagnose_;
  const Closures closures_of_;
  std::size_t odometry_ = 0, pose_ = 0, tf_ = 0, diagnostics_ = 0, faces_ = 0, log_ = 0, image_ = 0;
  LatestTopic path_, mesh_, map_2d_, closures_, objects_;
  LiveFrames frames_;
  std::size_t poses_ = 0;
  std::optional<Stamp> stamp_;    // stamp of the last image or keyframe
  std::optional<Stamp> latest_;   // greatest stamp that was published, because stamps must not
                                  // decrease
  double speed_mps_ = 0.0;        // speed at `stamp_`
  double stamp_arrived_s_ = 0.0;  // time of arrival of `stamp_`, by the steady clock
  Topic<Trajectory>::Message trajectory_ = std::make_shared<const Trajectory>();
  std::shared_ptr<const LabelledMesh> newest_mesh_;
  Topic<ObjectList>::Message newest_objects_;
  std::shared_ptr<const OccupancyGrid> newest_map_2d_;
  SurfacePieces pieces_;
  TokenBucket piece_bytes_;
  std::vector<PublishedClosure> newest_closures_;
  Worker<Encoded> encoder_;  // last member: stops first
};

}  // namespace km
