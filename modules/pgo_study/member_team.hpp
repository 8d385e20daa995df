#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "modules/pgo_study/team_graph.hpp"
#include "modules/pgo_study/team_solver.hpp"
#include "modules/pose_graph/member_solver.hpp"
#include "modules/pose_graph/session_graph.hpp"

namespace km {

/// Which robots hear each other.
enum class TeamShape {
  kAll,    ///< Everybody everybody.
  kChain,  ///< Robot k only k - 1 and k + 1.
};

/// A recorded graph solved by the members of a session as they are in the robots, with the letters
/// between them: one session after the other, until no closure that was rejected fits any more. The
/// tree is the robots' own. A step is over when every member has come a round further, or several
/// if the solver lets its members know of every few rounds only.
class MemberTeam final : public TeamSolver {
 public:
  using Factory = std::function<std::unique_ptr<MemberSolver>(SessionGraph, TreePlace)>;

  /// `start`: a pose for each of the graph's. `as_robots`: weights are what robots make of them
  /// that expect false closures, see estimate_odometry_noise() and limit_precisions(). Throws
  /// std::invalid_argument if there is another number of poses, and what `make` throws.
  MemberTeam(const TeamGraph& graph, Eigen::Index rank, std::vector<SE3> start, Factory make,
             TeamShape shape = TeamShape::kAll, bool as_robots = false);

  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }

  /// Of the graph's edges, whether they are used as things stand; odometry is.
  [[nodiscard]] std::vector<bool> kept() const;
  /// True if the members of the last session have come to its end.
  [[nodiscard]] bool done() const;
  [[nodiscard]] const SolverState& state() const { return state_; }
  /// Rounds in all, those of sessions before included.
  [[nodiscard]] std::uint32_t rounds() const { return rounds_; }
  /// Bytes that `robot` has sent and received.
  [[nodiscard]] std::size_t sent_by(std::size_t robot) const { return sent_[robot]; }
  [[nodiscard]] std::size_t received_by(std::size_t robot) const { return received_[robot]; }

 private:
  struct Delivery {
    RobotId from = 0;
    SolverLetter letter;
  };

  [[nodiscard]] std::map<std::size_t, TreePlace> places(TeamShape shape) const;
  void tell_starts(std::vector<SE3> start, RoundMeter* meter);
  void open_session();
  bool reconsider(RoundMeter& meter);
  void take_poses();
  bool pass_on(std::uint32_t round, RoundMeter& meter);

  TeamGraph graph_;
  Eigen::Index rank_;
  Factory make_;
  std::vector<SessionGraph> parts_;
  std::map<std::size_t, TreePlace> places_;
  std::vector<std::unique_ptr<MemberSolver>> members_;
  std::vector<Delivery> post_;
  std::vector<LiftedPoses> blocks_;
  std::map<ClosureId, bool> decided_;
  std::map<ClosureId, int> chances_;
  std::vector<std::size_t> sent_;
  std::vector<std::size_t> received_;
  std::size_t to_announce_ = 0;  // bytes of public poses
  SolverState state_;
  std::uint32_t rounds_ = 0;
  std::uint32_t rounds_before_ = 0;  // this session
};

}  // namespace km
