#pragma once

#include <map>
#include <random>
#include <vector>

#include "modules/pgo_study/proximal_block.hpp"
#include "modules/pgo_study/team_solver.hpp"

namespace km {

struct AsynchronousOptions {
  /// B: a robot moves on poses that lack at most so many of its neighbours' updates before the
  /// present round. Messages come up to so many rounds late, each as a draw decides.
  int max_delay = 0;
  double loss = 0.0;  ///< Probability that a message does not come to one of its receivers.
  unsigned seed = 1;  ///< Of delays and losses.
  double max_over_relaxation = 1.95;  ///< See growing_relaxation(); 1: none.
  TruncatedNewtonOptions block_update = {};
};

/// Block-coordinate descent without turns: in every round all robots move at the same time, on
/// whatever poses of their neighbours have come. The setting is that of asynchronous gradient
/// descent (Tian, Koppel, Bedi, How, "Asynchronous and Parallel Distributed Pose Graph
/// Optimization", RA-L 2020): bounded delay, and steps that shrink with the bound. Here the step is
/// a minimum of the whole block, held back where it meets others only, see ProximalBlock; without
/// delay that is the majorisation of Fan and Murphey ("Majorization Minimization Methods for
/// Distributed Pose Graph Optimization", 2021), twice the precision for every inter-robot edge.
///
/// Why it descends. Let D_a^t be the change of block a in round t, |D_a^t|_e that of the residual
/// of edge e = (a, b). The cost is quadratic in the lifted poses, so round t changes it by
///     sum_a (f_a(X_a + D_a; heard) - f_a(X_a; heard))
///       + sum_e 2 <D_a^t, D_b^t>_e + 2 <D_a^t, S_b>_e + 2 <D_b^t, S_a>_e ,
/// S_b being those of b's updates, B at most, that a had not heard of. A product 2 <u, v> is at
/// most |u|^2 + |v|^2: the round's own and the missed ones come to 1 + B times |D_a^t|_e^2 on the
/// side of a, and D_b of one round is missed by at most B updates of a. So with a weight of
/// 1 + 2 B every round lowers
///     V^t = F(X^t) + sum_e sum_(s > t - B) (s + B - t) (|D_a^s|_e^2 + |D_b^s|_e^2) ,
/// F never lies above F(X^0), and as the weight is 1 % larger the changes are square summable:
/// what is heard catches up with what is, and gradients tend to 0. No delay and no loss breaks
/// this, for a robot that lacks more than B rounds of a neighbour does not move until it hears.
class AsynchronousTeam : public TeamSolver {
 public:
  /// `start`: feasible poses of the whole graph, r x 4n. The first round tells them.
  /// Throws std::invalid_argument for a negative delay or a loss outside [0, 1).
  AsynchronousTeam(const TeamGraph& graph, const LiftedPoses& start,
                   const AsynchronousOptions& options);

  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return robots_[robot].block.X();
  }
  /// Of the robots that could move, summed over the rounds so far.
  [[nodiscard]] std::size_t updates() const { return updates_; }

 private:
  struct Robot {
    ProximalBlock block;
    std::map<RobotId, int> heard;  // round of the newest poses of each neighbour; 0: none
  };
  struct Letter {
    int due = 0;  // is there before the updates of this round
    int round = 0;
    RobotId sender = 0;
    std::size_t receiver = 0;
    ToldBlock poses;
  };

  void deliver(RoundMeter& meter);
  [[nodiscard]] bool may_move(const Robot& robot) const;
  void send(std::size_t k, RoundMeter& meter);

  AsynchronousOptions options_;
  std::mt19937 rng_;
  std::vector<Robot> robots_;
  std::vector<Letter> letters_;
  int round_ = 0;
  std::size_t updates_ = 0;
};

}  // namespace km
