#pragma once

#include <cstdint>
#include <functional>
#include <variant>

#include "modules/session/team_agent.hpp"
#include "runtime/dds/peers.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the team node; they must outlive it.
struct TeamTopics {
  In<KeyframeOdometry> odometry;       ///< Own keyframes, ascending.
  In<Closure> closures;                ///< Own and received ones.
  In<PositionFix> fixes;               ///< Own ones, ascending by keyframe.
  In<InlierSet> inlier_sets;           ///< Decided here.
  In<InlierSet> peer_inlier_sets;      ///< Decided by other robots.
  In<InlierSet> restored_inlier_sets;  ///< Sets of a former process, older than all others.
  In<PeerEvent> peer_events;           ///< Robots that are received directly.
  In<PeerEvent> restarts;         ///< kRestarted, before the first closure of the new incarnation.
  In<LinksReport> links;          ///< Links of the team.
  In<TeamMessage> peer_messages;  ///< From the other robots.
  Out<TeamMessage> messages;      ///< To the other robots.
  Out<Trajectory> trajectory;
  Out<OptimizerProgress> progress;
  Out<ClosureVerdicts> verdicts;  ///< After sessions that weigh closures.
};

/// A restarted robot: its keyframe indices have a new meaning.
struct NewIncarnation {
  TeamPeer peer;
};
using TeamInput =
    std::variant<Tick, Topic<KeyframeOdometry>::Message, Topic<Closure>::Message,
                 Topic<PositionFix>::Message, Topic<InlierSet>::Message, Topic<PeerEvent>::Message,
                 NewIncarnation, Topic<LinksReport>::Message, Topic<TeamMessage>::Message>;

/// The part of one robot in the pose graph optimisation of the team: a TeamAgent on its thread.
///
/// Inputs are processed as they arrive. Optimisation continues piece by piece while no input is
/// waiting, so that a large graph delays a message by at most one piece. Notices of the agent are
/// logged at a limited rate.
class TeamNode final : public WorkerNode<TeamInput> {
 public:
  /// `self`: as announced by the participant. `solvers`: creates the solver of each session. Throws
  /// ConfigError if `config` is out of bounds. `sent_bytes`: see TeamAgent::step(). `dimension`:
  /// see TeamAgent.
  TeamNode(const PoseGraphConfig& config, TeamPeer self, MemberSolverFactory solvers,
           std::function<std::uint64_t()> sent_bytes, const TeamTopics& topics, int dimension = 3);
  ~TeamNode() override { stop(); }

  /// See TeamAgent. Call before start().
  void begin_in_map(std::uint64_t map_id) { agent_.begin_in_map(map_id); }
  void restore(const TeamSolution& solution) { agent_.restore(solution); }

  /// Handles one input synchronously at time `now_s`. The thread calls only this; so can tests.
  void step(const Input& input, double now_s);

 private:
  void handle(const Input& input) override { step(input, steady_now_s()); }
  void take(const Input& input);
  void take_peer_event(const PeerEvent& event);
  void publish(TeamOutput output);

  const TeamPeer self_;
  const TeamTopics topics_;
  const std::function<std::uint64_t()> sent_bytes_;
  TeamAgent agent_;
  std::size_t rejected_ = 0;  // closures of this robot that the last verdicts reject
};

}  // namespace km
