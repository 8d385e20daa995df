#pragma once

#include <atomic>
#include <exception>
#include <string_view>
#include <variant>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/surface_ties/tie_search.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of the surface ties node; they must outlive it.
struct SurfaceTiesTopics {
  In<MeshChunk> own_chunks;
  In<MeshChunk> peer_chunks;
  In<MeshPoses> own_poses;
  In<MeshPoses> peer_poses;
  In<Closure> closures;            ///< Own and received ones.
  In<OptimizerProgress> progress;  ///< States which robots have joined.
  In<PeerEvent> restarts;          ///< kRestarted, as for PcmNode.
  Out<Closure> ties;
  Out<ClosureOutcome> outcomes;
};

/// Ties this robot to itself and to robots with higher ids by the surfaces in their mesh chunks.
/// Runs a TieSearch on a thread of its own, which takes less than a tenth of a processor.
class SurfaceTiesNode final : public Node {
 public:
  /// `max_gap_keyframes`: see TieSearch.
  SurfaceTiesNode(RobotId self, KeyframeIndex max_gap_keyframes, const SurfaceTiesTopics& topics);
  ~SurfaceTiesNode() override { stop(); }

  /// An own keyframe; before the chunks that it moves. Thread-safe; returns at once.
  void learn(const OdometryPose& keyframe) { post(keyframe); }

  std::string_view name() const override { return "surface_ties"; }
  void start() override;
  void stop() noexcept override;
  std::exception_ptr error() const override;
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

  /// True if the chunks and closures so far lead to no further tie. Thread-safe.
  [[nodiscard]] bool is_done() const { return handled_ == arrived_ && search_done_; }

  struct Tick {};
  using Input = std::variant<Tick, OdometryPose, Topic<MeshChunk>::Message,
                             Topic<MeshPoses>::Message, Topic<Closure>::Message,
                             Topic<OptimizerProgress>::Message, Topic<PeerEvent>::Message>;

  /// Handles one input synchronously at time `now_s`. The thread calls only this function; tests
  /// can call it too.
  void step(const Input& input, double now_s);

 private:
  void post(Input input);
  void take(const OptimizerProgress& progress);
  void search(double now_s);

  const RobotId self_;
  const Out<Closure> ties_;
  const Out<ClosureOutcome> outcomes_;
  TieSearch search_;
  double next_s_ = 0.0;                                 // time of the next registration
  std::atomic<std::size_t> arrived_ = 0, handled_ = 0;  // inputs, without ticks
  std::atomic<bool> search_done_ = true;
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

}  // namespace km
