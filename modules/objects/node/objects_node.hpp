#pragma once

#include <map>
#include <optional>
#include <variant>

#include "modules/core/data/pose_graph.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/objects/object_extraction.hpp"
#include "modules/objects/team_objects.hpp"
#include "runtime/latest.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the objects node; they must outlive it.
struct ObjectsTopics {
  In<OptimizedMesh> meshes;   ///< Meshes of this robot; only the newest counts.
  In<Trajectory> trajectory;  ///< Trajectory of this robot; only the newest counts.
  In<RobotObjects> received;  ///< From other robots.
  Out<RobotObjects> own;      ///< To other robots.
  Out<ObjectList> joint;      ///< Objects of all robots in `world`, whenever they change.
};

/// Extracts the objects of the robot's mesh, sends them to the other robots, and merges them with
/// those that it receives. A message is sent if objects have changed, at most every
/// ObjectsConfig::period_s.
class ObjectsNode final
    : public WorkerNode<std::variant<Tick, Topic<RobotObjects>::Message, OdometryPose>> {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  ObjectsNode(const ObjectsConfig& config, RobotId self, const LabelPalette& palette,
              const ObjectsTopics& topics);
  ~ObjectsNode() override { stop(); }

  [[nodiscard]] const LabelPalette& palette() const { return palette_; }

  /// Odometry of a keyframe of this robot, so that messages state it. Thread-safe.
  void learn(const OdometryPose& keyframe) { post(keyframe); }

  /// Handles one input, and the newest mesh and trajectory, at time `now_s`. The thread calls only
  /// this function; tests can call it too.
  void step(const Input& input, double now_s);

  /// The joint objects with the last trajectory of the robot, or nullopt if there are no objects
  /// and no trajectory. Call after stop().
  [[nodiscard]] std::optional<ObjectList> finish(const std::optional<Trajectory>& trajectory);

 private:
  void handle(const Input& input) override { step(input, steady_now_s()); }
  void take(const OptimizedMesh& mesh);
  void take(const RobotObjects& received);
  void send(double now_s);

  const ObjectsConfig config_;
  const RobotId self_;
  const LabelPalette palette_;
  const ObjectLabels labels_;
  const Out<RobotObjects> own_;
  const Out<ObjectList> joint_;
  TeamObjects team_;
  std::map<KeyframeIndex, OdometryPose> keyframes_;
  Topic<Trajectory>::Message trajectory_;
  bool changed_ = false;                 // since the joint objects were published
  std::optional<RobotObjects> to_send_;  // newest own objects that have not been sent
  std::optional<RobotObjects> last_sent_;
  double next_s_ = 0.0;  // earliest time of the next message
  Latest<OptimizedMesh> latest_mesh_;
  Latest<Trajectory> latest_trajectory_;
};

}  // namespace km
