#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "apps/lab/pgo/round_meter.hpp"
#include "apps/lab/pgo/team_graph.hpp"
#include "modules/robust/member_solver.hpp"
#include "modules/robust/session_graph.hpp"

namespace km {

/// Solves a recorded graph by the members of one session, from a common start. They are the same
/// code as in the robots, with the same messages. The tree is planned by the robots' own code.
class MemberTeam {
 public:
  using Factory = std::function<std::unique_ptr<MemberSolver>(SessionGraph, TreePlace)>;

  /// `start`: one pose for each pose of the graph. Throws std::invalid_argument if the number of
  /// poses differs, and what `make` throws.
  MemberTeam(const TeamGraph& graph, std::vector<SE3> start, const Factory& make);

  /// Advances every member by a round, or by several if the solver publishes its state only every
  /// few rounds. Returns the number of rounds; 0: nothing was left to do.
  int step(RoundMeter& meter);
  /// Poses of all robots, in the numbering of the graph.
  [[nodiscard]] std::vector<SE3> poses() const;

  /// True if all members are done.
  [[nodiscard]] bool done() const;
  [[nodiscard]] const SolverState& state() const { return state_; }
  [[nodiscard]] std::uint32_t rounds() const { return rounds_; }

 private:
  struct Delivery {
    RobotId from = 0;
    SolverMessage message;
  };

  [[nodiscard]] std::map<std::size_t, TreePlace> places() const;
  void announce_starts(std::vector<SE3> start);
  bool pass_on(std::uint32_t round, RoundMeter& meter);

  TeamGraph graph_;
  std::vector<SessionGraph> parts_;
  std::map<std::size_t, TreePlace> places_;
  std::vector<std::unique_ptr<MemberSolver>> members_;
  std::vector<Delivery> in_flight_;
  std::size_t to_announce_ = 0;  // bytes of the public poses still to be counted
  SolverState state_;
  std::uint32_t rounds_ = 0;
};

/// Steps `team` until it is done, or `max_rounds` are over. See run_rounds().
[[nodiscard]] std::vector<TeamRound> run_team(const TeamGraph& graph, MemberTeam& team,
                                              int max_rounds, const TeamMeter& meter);

}  // namespace km
