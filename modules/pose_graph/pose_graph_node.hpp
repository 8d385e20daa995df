#pragma once

#include <exception>
#include <memory>
#include <string_view>
#include <variant>

#include "modules/pose_graph/pgo_agent.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of the pose graph node; they must outlive it. `peer_*` come from other robots.
struct PoseGraphTopics {
  Topic<KeyframeOdometry>& odometry;         ///< In: own keyframes, ascending.
  Topic<Closure>& closures;                  ///< In: own and received ones.
  Topic<InlierSet>& inlier_sets;             ///< In: decided here.
  Topic<InlierSet>& peer_inlier_sets;        ///< In.
  Topic<PeerEvent>& peer_events;             ///< In.
  Topic<PgoStatus>& peer_status;             ///< In.
  Topic<PgoSession>& peer_sessions;          ///< In.
  Topic<PublicPoses>& peer_poses;            ///< In.
  Topic<SolverMessage>& peer_exchanges;      ///< In.
  const Topic<PgoStatus>& status;            ///< Out, to all robots: state, key robot.
  const Topic<PgoSession>& sessions;         ///< Out, to all robots: state, key robot.
  const Topic<PublicPoses>& poses;           ///< Out, to all robots: state, key robot.
  const Topic<SolverMessage>& exchanges;     ///< Out, to all robots: state, keys robot and slot.
  const Topic<Trajectory>& trajectory;       ///< Out.
  const Topic<OptimizerProgress>& progress;  ///< Out.
  const Topic<ClosureVerdicts>& verdicts;    ///< Out, where closures are rejected.
};

/// One robot's part of distributed pose graph optimisation: an PgoAgent on its thread.
///
/// Inputs are taken in as they come; optimisation goes on by single block updates or exchanges
/// while none is waiting, so that a heavy graph delays a message by one of them at most.
class PoseGraphNode final : public Node {
 public:
  /// `self` as the participant announces it. Throws ConfigError if `config` is out of bounds.
  PoseGraphNode(const PoseGraphConfig& config, PgoPeer self, const PoseGraphTopics& topics);
  ~PoseGraphNode() override { stop(); }

  std::string_view name() const override { return PoseGraphConfig::kSection; }
  void start() override;
  void stop() noexcept override;
  std::exception_ptr error() const override;
  DurationHistogram timing() const override { return worker_.timing(); }

  /// Time passes. Always null: as a plain struct among pointers it sets off a false alarm of
  /// GCC 12.
  using Tick = std::shared_ptr<const struct TickTag>;
  using Input = std::variant<Tick, Topic<KeyframeOdometry>::Message, Topic<Closure>::Message,
                             Topic<InlierSet>::Message, Topic<PeerEvent>::Message,
                             Topic<PgoStatus>::Message, Topic<PgoSession>::Message,
                             Topic<PublicPoses>::Message, Topic<SolverMessage>::Message>;

  /// Handles one input synchronously at time `now_s`. The thread calls only this; so can tests.
  void step(const Input& input, double now_s);

 private:
  void take(const Input& input);
  void take_peer_event(const PeerEvent& event);
  void take_status(const PgoStatus& status);
  void refuse(const char* kind, RobotId from) const;
  void publish(PgoOutput output) const;
  void publish(ClosureVerdicts verdicts) const;

  const PoseGraphTopics topics_;
  const PgoMethod method_;
  PgoAgent agent_;
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

}  // namespace km
