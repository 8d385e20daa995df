#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "runtime/latest.hpp"
#include "runtime/metrics.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the mesh deformation node; they must outlive it.
struct MeshDeformationTopics {
  In<MapMesh> maps;                ///< Only the newest map counts.
  In<KeyframeOdometry> keyframes;  ///< Own keyframes, ascending.
  In<Trajectory> trajectory;       ///< Own trajectory; only the newest counts.
  Out<OptimizedMesh> optimized;
  Out<SupersededSurface> superseded;  ///< Superseded surface of the maps, for the mapper.
};

/// The call of MeshDeformationNode::finish(), a pointer that is always null, as Tick.
using MeshEnd = std::shared_ptr<const struct MeshEndTag>;
using MeshDeformationInput =
    std::variant<Tick, MeshEnd, Topic<MapMesh>::Message, Topic<KeyframeOdometry>::Message,
                 Topic<Trajectory>::Message>;

/// Corrects the robot's mesh when its map or its trajectory has changed: runs a MeshCorrector on a
/// thread of its own. A correction starts at least mesh_deformation.period_s after the end of the
/// last one, and not before nine times its duration have passed. Messages that arrive meanwhile are
/// only stored, so that this node delays no other node.
class MeshDeformationNode final : public WorkerNode<MeshDeformationInput> {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  MeshDeformationNode(const MeshDeformationConfig& config, RobotId self,
                      const MeshDeformationTopics& topics);
  ~MeshDeformationNode() override { stop(); }

  /// Durations of the corrections.
  DurationHistogram timing() const override { return timing_.histogram(); }

  /// Requests a last correction, from scratch and without a pause, of all input so far. The result
  /// does not depend on earlier corrections or their times. Later input is ignored. Returns at
  /// once. Idempotent, thread-safe.
  void finish();

  /// True once the mesh agrees with the newest map and the newest trajectory, or if there is none.
  /// Thread-safe.
  [[nodiscard]] bool is_current() const { return corrected_ == arrived_; }

  /// Handles one input synchronously at time `now_s`. The thread calls only this function; tests
  /// can call it too. Throws std::invalid_argument for keyframes that are not consecutive and for
  /// input that optimize_mesh() refuses.
  void step(const Input& input, double now_s);

 private:
  void handle(const Input& input) override;
  void stop_sources() noexcept override { finish(); }
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
  Topic<Trajectory>::Message solved_;  // the last trajectory that has covariances
  double next_s_ = 0.0;
  bool ended_ = false;
  // Numbers of maps and trajectories: that have arrived, of which the newest are handled, and with
  // which the mesh is corrected.
  std::atomic<std::uint64_t> arrived_ = 0, corrected_ = 0;
  std::uint64_t handled_ = 0;
  Timing timing_;
  Latest<MapMesh> latest_map_;  // newest map, until it is handled
  Latest<Trajectory> latest_trajectory_;
};

}  // namespace km
