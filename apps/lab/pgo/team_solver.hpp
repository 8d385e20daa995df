#pragma once

#include <vector>

#include "apps/lab/pgo/round_meter.hpp"
#include "apps/lab/pgo/team_graph.hpp"

namespace km {

/// A distributed method, run for a whole team in one process. Each robot has one agent, which
/// computes only from its own part of the graph and from messages of earlier rounds.
class TeamSolver {
 public:
  virtual ~TeamSolver() = default;

  /// Advances by one round, or by several if the method publishes poses only after several. Returns
  /// the number of rounds; 0: nothing was left to do. In a round every robot may compute inside
  /// meter.run(robot, ...) from messages sent before. It reports the bytes of its own messages by
  /// meter.sent(...). A setup that needs an exchange (factors, reductions of inner products) takes
  /// rounds as well.
  virtual int step(RoundMeter& meter) = 0;

  /// Current poses of a robot, r x 4 n_k, feasible, all robots in one frame.
  [[nodiscard]] virtual const LiftedPoses& block(std::size_t robot) const = 0;
};

/// State of the team after a round.
struct TeamRound {
  int round = 0;               ///< Rounds of the team so far.
  double cost = 0.0;           ///< Chordal cost, without 1/2, of the lifted poses, with all
                               ///< verticals.
  double gradient_norm = 0.0;  ///< Riemannian gradient of the whole graph.
  TeamWork work;               ///< Work up to and including this round.
};

struct TeamRunOptions {
  int max_rounds = 1000;
  double gradient_tolerance = 0.0;  ///< Ends the run once the gradient norm is at most this.
};

/// The blocks of all robots side by side, in the numbering of `graph`.
[[nodiscard]] LiftedPoses team_poses(const TeamGraph& graph, const TeamSolver& solver);

/// Steps `solver` until it has nothing left to do, or until a limit of `options`. Cost and gradient
/// are evaluated centrally, and their CPU time is not counted. Entry 0 is the state at the start,
/// without work.
[[nodiscard]] std::vector<TeamRound> run_team(const TeamGraph& graph, TeamSolver& solver,
                                              const TeamRunOptions& options,
                                              const TeamMeter& meter);

}  // namespace km
