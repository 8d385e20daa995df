#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <string_view>
#include <variant>
#include <vector>

#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "runtime/latest.hpp"
#include "runtime/metrics.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of the mesh deformation node; they must outlive it.
struct MeshDeformationTopics {
  In<MapMesh> maps;                ///< The newest counts.
  In<KeyframeOdometry> keyframes;  ///< Own ones, ascending.
  In<Trajectory> trajectory;       ///< Own, the newest counts.
  Out<OptimizedMesh> optimized;
  Out<SupersededSurface> superseded;  ///< Of the maps, for the mapper.
};

/// Corrects the robot's mesh when its map or its trajectory changed: a MeshCorrector on its thread.
/// A correction never starts earlier than mesh_deformation.period_s after the last one ended. What
/// comes meanwhile is only kept: this node delays nobody.
class MeshDeformationNode final : public Node {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  MeshDeformationNode(const MeshDeformationConfig& config, RobotId self,
                      const MeshDeformationTopics& topics);
  ~MeshDeformationNode() override { stop(); }

  std::string_view name() const override { return MeshDeformationConfig::kSection; }
  void start() override;
  void stop() noexcept override;  ///< After finish().
  std::exception_ptr error() const override;
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  /// A correction takes the longer the larger the mesh is.
  double step_limit_s() const override { return 120.0; }

  /// Of the corrections.
  DurationHistogram timing() const override { return timing_.histogram(); }

  /// One last correction, afresh and whatever the time, of what has come so far: the result does
  /// not depend on the corrections before, nor on when they were. What comes later is ignored.
  /// Returns at once. Idempotent, thread-safe.
  void finish();

  /// Time passes, and the end. Always null: as plain structs among pointers they set off a false
  /// alarm of GCC 12.
  using Tick = std::shared_ptr<const struct MeshTickTag>;
  using End = std::shared_ptr<const struct MeshEndTag>;
  using Input = std::variant<Tick, End, Topic<MapMesh>::Message, Topic<KeyframeOdometry>::Message,
                             Topic<Trajectory>::Message>;

  /// Handles one input synchronously at time `now_s`. The thread calls only this; so can tests.
  /// Throws std::invalid_argument for keyframes that are not consecutive and for what
  /// LocalMeshOptimizer::optimize() refuses.
  void step(const Input& input, double now_s);

 private:
  void take_latest(double now_s);
  void take(const KeyframeOdometry& keyframe);
  void take(Topic<MapMesh>::Message map);
  void correct();
  [[nodiscard]] bool can_correct() const;
  [[nodiscard]] CorrectionInput input() const;
  void report(const OptimizedMesh& result) const;

  const MeshDeformationConfig config_;
  const RobotId self_;
  const Out<OptimizedMesh> optimized_;
  const Out<SupersededSurface> superseded_;
  MeshCorrector corrector_;
  Topic<MapMesh>::Message map_;
  std::uint64_t map_version_ = 0;
  std::size_t keyframes_of_map_ = 0;
  std::vector<SE3> T_odom_kf_;
  Topic<Trajectory>::Message trajectory_;
  double next_s_ = 0.0;
  bool ended_ = false;
  Timing timing_;
  Latest<MapMesh> latest_map_;  // not yet handled
  Latest<Trajectory> latest_trajectory_;
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

}  // namespace km
