#pragma once

#include <vector>

#include "modules/pgo_study/round_meter.hpp"
#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// A distributed method, run for a whole team in one process: one agent per robot, each of which
/// computes from its own part of the graph and from the messages of earlier rounds only.
class TeamSolver {
 public:
  virtual ~TeamSolver() = default;

  /// One round, which is one exchange: every robot may compute, inside meter.run(robot, ...), from
  /// what was sent in rounds before, and send, told to meter.sent(...) in bytes. Setup that needs
  /// an exchange (factors, reductions of inner products) takes rounds like any other. False:
  /// nothing was left to do, and the round does not count.
  virtual bool step(RoundMeter& meter) = 0;

  /// Present poses of a robot, r x 4 n_k, feasible, all robots in one frame.
  [[nodiscard]] virtual const LiftedPoses& block(std::size_t robot) const = 0;
};

/// State of the team after a round.
struct TeamRound {
  double cost = 0.0;           ///< Chordal, without 1/2, at the lifted poses, with all verticals.
  double gradient_norm = 0.0;  ///< Riemannian, of the whole graph.
  TeamWork work;               ///< Up to and including this round.
};

struct TeamRunOptions {
  int max_rounds = 1000;
  double gradient_tolerance = 0.0;  ///< Ends the run once the gradient norm is at most this.
};

/// The blocks of all robots side by side, in the numbering of `graph`.
[[nodiscard]] LiftedPoses team_poses(const TeamGraph& graph, const TeamSolver& solver);

/// Steps `solver` until it has nothing left to do, or as `options` say. Cost and gradient are
/// evaluated centrally, at nobody's expense. Entry 0 is the state at the start, without work.
[[nodiscard]] std::vector<TeamRound> run_team(const TeamGraph& graph, TeamSolver& solver,
                                              const TeamRunOptions& options,
                                              const TeamMeter& meter);

}  // namespace km
