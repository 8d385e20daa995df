#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"
#include "apps/lab/pgo/team_solver.hpp"
#include "modules/pose_graph/closure_decisions.hpp"
#include "modules/pose_graph/member_solver.hpp"
#include "modules/pose_graph/session_graph.hpp"

namespace km {

/// Links between the robots.
enum class TeamShape {
  kAll,    ///< Every pair of robots has a link.
  kChain,  ///< Robot k has links to k - 1 and k + 1 only.
};

/// Solves a recorded graph by the members of a session, the same code as in the robots, and their
/// messages. Sessions follow each other until no rejected closure fits the solution (see
/// ClosureDecisions::reconsider()). The tree is planned by the robots' own code. A step is over
/// when every member has advanced by a round. A step covers several rounds if the solver publishes
/// its state only every few rounds.
class MemberTeam final : public TeamSolver {
 public:
  using Factory = std::function<std::unique_ptr<MemberSolver>(SessionGraph, TreePlace)>;

  /// `start`: one pose for each pose of the graph. `as_robots`: weights are corrected as robots do
  /// that expect false closures, see judge_odometry() and limit_precisions(), and each robot first
  /// solves its own edges alone, see relaxed_start(). Throws
  /// std::invalid_argument if the number of poses differs, and what `make` throws.
  MemberTeam(const TeamGraph& graph, Eigen::Index rank, std::vector<SE3> start, Factory make,
             TeamShape shape = TeamShape::kAll, bool as_robots = false);

  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }

  /// By edge of the graph: whether the current solution uses it. Odometry is always used.
  [[nodiscard]] std::vector<bool> kept() const;
  /// True if all members of the last session are done.
  [[nodiscard]] bool done() const;
  [[nodiscard]] const SolverState& state() const { return state_; }
  /// Rounds of all sessions.
  [[nodiscard]] std::uint32_t rounds() const { return rounds_; }
  /// Bytes that `robot` has sent.
  [[nodiscard]] std::size_t sent_by(std::size_t robot) const { return sent_[robot]; }
  [[nodiscard]] std::size_t received_by(std::size_t robot) const { return received_[robot]; }

 private:
  struct Delivery {
    RobotId from = 0;
    SolverMessage message;
  };

  [[nodiscard]] std::map<std::size_t, TreePlace> places(TeamShape shape) const;
  void solve_alone_first(std::vector<SE3>& start);
  void announce_starts(std::vector<SE3> start);
  void open_session();
  bool reconsider();
  void take_poses();
  bool pass_on(std::uint32_t round, RoundMeter& meter);

  TeamGraph graph_;
  Eigen::Index rank_;
  Factory make_;
  std::vector<SessionGraph> parts_;
  std::map<std::size_t, TreePlace> places_;
  std::vector<std::unique_ptr<MemberSolver>> members_;
  std::vector<Delivery> in_flight_;
  std::vector<LiftedPoses> blocks_;
  ClosureDecisions decisions_;  // decisions of all members
  std::vector<std::size_t> sent_;
  std::vector<std::size_t> received_;
  std::size_t to_announce_ = 0;  // bytes of the public poses still to be counted
  SolverState state_;
  std::uint32_t rounds_ = 0;
  std::uint32_t rounds_before_ = 0;  // rounds before this session
};

}  // namespace km
