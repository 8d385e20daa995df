#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "apps/robot/assemblies/topics.hpp"
#include "apps/robot/robot_input.hpp"
#include "modules/journal/restored_run.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/shared_seal.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// The nodes of a robot in the order of the data flow, in which they stop.
class NodeList {
 public:
  NodeList(SignalWatch& signals, double patience) : supervisor_(signals, patience) {}

  template <typename NodeType, typename... Arguments>
  NodeType& add(Arguments&&... arguments) {
    auto node = std::make_unique<NodeType>(std::forward<Arguments>(arguments)...);
    NodeType& added = *node;
    add(std::move(node));
    return added;
  }
  void add(std::unique_ptr<Node> node) {
    nodes_.push_back(node.get());
    supervisor_.add(std::move(node));
  }

  /// Adds a node that belongs to the way from the source to new keyframes.
  template <typename NodeType, typename... Arguments>
  NodeType& add_feeding(Arguments&&... arguments) {
    auto& added = add<NodeType>(std::forward<Arguments>(arguments)...);
    feeding_.push_back(&added);
    return added;
  }

  [[nodiscard]] const std::vector<const Node*>& all() const { return nodes_; }
  /// Stops the nodes of add_feeding(), see Supervisor::have_stopped().
  bool have_fed() { return supervisor_.have_stopped(feeding_); }
  [[nodiscard]] Supervisor& supervisor() { return supervisor_; }

 private:
  std::vector<const Node*> nodes_;
  std::vector<Node*> feeding_;
  Supervisor supervisor_;
};

/// The run that a robot continues, if there is one.
struct Past {
  std::optional<RestoredRun> run;  ///< Empty once the robot is built.
  RestoredFrom from = RestoredFrom::kFormerProcess;
  bool is_resumed = false;  ///< This process continues the run of a former one.

  /// Takes the former run from `input`.
  explicit Past(RobotInput& input)
      : run(std::move(input.restored)),
        from(input.restored_from),
        is_resumed(run && !begins_at_origin() && !std::holds_alternative<PastRun>(input.source)) {}

  /// True if keyframe 0 is the origin of the frame of a map or of fixes, and not of this run.
  [[nodiscard]] bool begins_at_origin() const {
    return from == RestoredFrom::kFinishedMap || from == RestoredFrom::kDatum;
  }
  /// True if a former process left a solution of the pose graph.
  [[nodiscard]] bool has_solution() const {
    return run && !run->solution.trajectory.T_world_kf.empty();
  }
  /// A resumed run continues its incarnation.
  [[nodiscard]] std::uint64_t next_boot_id() const {
    return is_resumed ? next_boot(run->boot) : random_boot_id();
  }
};

/// The parts that all assemblies of a robot use. An assembly adds nodes, connects them by topics,
/// and answers for them. It must outlive the nodes.
struct RobotCore {
  Past past;
  const RobotIdentity identity;
  const std::shared_ptr<SharedSeal> seal;  ///< Null without keys.
  DdsParticipant participant;
  NodeList& nodes;
  DdsBridge* bridge = nullptr;
  Topics topics = {};
  std::atomic<RobotPhase> phase = RobotPhase::kRunning;
};

}  // namespace km
