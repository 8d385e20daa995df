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

  /// Goes on by a round, or by several if poses come after several only, and returns how many they
  /// were; 0: nothing was left to do. In a round every robot may compute, inside
  /// meter.run(robot, ...), from what was sent before, and send, told to meter.sent(...) in bytes.
  /// Setup that needs an exchange (factors, reductions of inner products) takes rounds like any
  /// other.
  virtual int step(RoundMeter& meter) = 0;

  /// Present poses of a robot, r x 4 n_k, feasible, all robots in one frame.
  [[nodiscard]] virtual const LiftedPoses& block(std::size_t robot) const = 0;
};

/// State of the team after a round.
struct TeamRound {
  int round = 0;               ///< Rounds of the team until then.
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
