#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <string_view>
#include <variant>

#include "modules/core/label_palette.hpp"
#include "modules/mesh/gone_surface.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "modules/team_map/team_map.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of TeamMapNode; they must outlive it. `own`: messages that this robot has sent;
/// `received`: those of the other robots.
struct TeamMapTopics {
  In<MeshChunk> own_chunks, received_chunks;
  In<MeshPoses> own_poses, received_poses;
  Out<GoneSurface> own_gone;
  In<GoneSurface> received_gone;
};

struct TeamMapSettings {
  RobotId self = 0;
  double voxel_m = 0.1;
  int seen_through_views = 3;  ///< As in MeshDeformationConfig; 0: own views remove nothing.
};

/// Stores the chunks and poses of all robots, and fuses them into one mesh when it is asked for.
/// Publishes the surface of other robots that own views see through.
class TeamMapNode final : public Node {
 public:
  /// `palette` colours the mesh, if it has classes.
  TeamMapNode(const TeamMapSettings& settings, LabelPalette palette, const TeamMapTopics& topics);
  ~TeamMapNode() override { stop(); }

  std::string_view name() const override { return "team_map"; }
  void start() override;
  void stop() noexcept override;  ///< Takes the messages that have arrived.
  std::exception_ptr error() const override;
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

  [[nodiscard]] const LabelPalette& palette() const { return palette_; }

  /// The views of this robot, with its present poses. Only the newest count. Thread-safe; returns
  /// at once.
  void offer(std::shared_ptr<const OwnViews> own);

  /// True once all surface is compared with the offered views. Thread-safe.
  [[nodiscard]] bool is_done() const { return waiting_ == 0 && !is_due_; }

  /// Fuses all chunks so far and colours the mesh; takes seconds for a large map.
  /// Thread-safe.
  [[nodiscard]] TeamMap fuse() const;

 private:
  using Views = std::shared_ptr<const OwnViews>;  // null: a tick of the clock
  using Input = std::variant<Topic<MeshChunk>::Message, Topic<MeshPoses>::Message,
                             Topic<GoneSurface>::Message, Views>;

  void take(const Input& input);
  void take_message(const Input& input);
  void find_own_gone(double now_s);

  const TeamMapSettings settings_;
  const LabelPalette palette_;
  const Out<GoneSurface> own_gone_;
  mutable std::mutex mutex_;  // guards chunks_
  TeamMesh chunks_;
  SurfaceArrivals arrivals_;
  Views own_;
  GoneSurface sent_;
  double next_s_ = 0.0;
  std::atomic<int> waiting_ = 0;      // offered views that are not taken
  std::atomic<bool> is_due_ = false;  // surface or poses have changed since the last comparison
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

}  // namespace km
