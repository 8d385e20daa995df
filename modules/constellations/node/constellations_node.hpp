#pragma once

#include <atomic>
#include <variant>

#include "modules/constellations/constellation_search.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/objects/map_object.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the constellations node; they must outlive it.
struct ConstellationsTopics {
  In<RobotObjects> own_objects;
  In<RobotObjects> peer_objects;
  In<Closure> closures;    ///< Own and received ones.
  In<PeerEvent> restarts;  ///< kRestarted, as for PcmNode.
  Out<Closure> found;
  Out<ClosureOutcome> outcomes;
};

/// Finds places in common with robots with higher ids by their objects. Runs a ConstellationSearch
/// on a thread of its own, which takes less than a tenth of a processor.
class ConstellationsNode final
    : public WorkerNode<std::variant<Tick, Topic<RobotObjects>::Message, Topic<Closure>::Message,
                                     Topic<PeerEvent>::Message>> {
 public:
  ConstellationsNode(RobotId self, const ConstellationsTopics& topics);
  ~ConstellationsNode() override { stop(); }

  /// True if the objects and closures so far lead to no further closure. Thread-safe.
  [[nodiscard]] bool is_done() const { return handled_ == posted_ && search_done_; }

  /// Handles one input synchronously at time `now_s`. The thread calls only this function; tests
  /// can call it too.
  void step(const Input& input, double now_s);

 private:
  void handle(const Input& input) override { step(input, steady_now_s()); }
  void count_and_post(Input input);
  void search(double now_s);

  const Out<Closure> found_;
  const Out<ClosureOutcome> outcomes_;
  ConstellationSearch search_;
  double next_s_ = 0.0;                                // time of the next match
  std::atomic<std::size_t> posted_ = 0, handled_ = 0;  // inputs, without ticks
  std::atomic<bool> search_done_ = true;
};

}  // namespace km
