#pragma once

#include <map>
#include <random>
#include <vector>

#include "apps/lab/pgo_study/proximal_block.hpp"
#include "apps/lab/pgo_study/team_solver.hpp"

namespace km {

struct AsynchronousOptions {
  /// B [rounds]: the age of neighbours' poses at which a robot still moves. At most B updates of a
  /// neighbour before the current round may be missing. Messages arrive 0 to B rounds late, drawn
  /// at random.
  int max_delay = 0;
  double loss = 0.0;  ///< Probability that a message does not reach one of its receivers.
  unsigned seed = 1;  ///< Seed of the delays and losses.
  double max_over_relaxation = 1.95;  ///< See relaxation_after(); 1: none.
  TruncatedNewtonOptions block_update = {};
};

/// Block-coordinate descent without turns. In every round all robots move at the same time, on the
/// newest poses of their neighbours that have arrived. The setting is that of asynchronous gradient
/// descent (Tian, Koppel, Bedi, How, "Asynchronous and Parallel Distributed Pose Graph
/// Optimization", RA-L 2020): delays are bounded, and steps shrink with the bound. Here a step
/// minimises the cost of the whole block plus a proximal term on its inter-robot edges (see
/// ProximalBlock). Without delay this is the majorisation of Fan and Murphey ("Majorization
/// Minimization Methods for Distributed Pose Graph Optimization", 2021): every inter-robot edge has
/// twice its precision.
///
/// Proof of descent. Let D_a^t be the change of block a in round t, and |D_a^t|_e the change of the
/// residual of edge e = (a, b). The cost is quadratic in the lifted poses, so round t changes it by
///     sum_a (f_a(X_a + D_a; received) - f_a(X_a; received))
///       + sum_e 2 <D_a^t, D_b^t>_e + 2 <D_a^t, S_b>_e + 2 <D_b^t, S_a>_e ,
/// and S_b is the sum of those updates of b, at most B, that a had not received. A product 2 <u,
/// v> is at most |u|^2 + |v|^2. The product of the current round and those with missed updates
/// therefore contribute at most 1 + B times |D_a^t|_e^2 on the side of a. D_b of one round is
/// missed by at most B updates of a. With a weight of 1 + 2 B every round therefore lowers
///     V^t = F(X^t) + sum_e sum_(s > t - B) (s + B - t) (|D_a^s|_e^2 + |D_b^s|_e^2) ,
/// and F never lies above F(X^0). The weight is 1 % larger, so the changes are square summable:
/// received poses converge to the current ones, and gradients tend to 0. Delay and loss cannot
/// break this, because a robot does not move while it lacks more than B rounds of a neighbour.
class AsynchronousTeam : public TeamSolver {
 public:
  /// `start`: feasible poses of the whole graph, r x 4n. The robots send them in the first round.
  /// Throws std::invalid_argument for a negative delay or a loss outside [0, 1).
  AsynchronousTeam(const TeamGraph& graph, const LiftedPoses& start,
                   const AsynchronousOptions& options);

  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return robots_[robot].block.X();
  }
  /// Number of block updates of all robots so far.
  [[nodiscard]] std::size_t updates() const { return updates_; }

 private:
  struct Robot {
    ProximalBlock block;
    std::map<RobotId, int> received;  // round of the newest received poses, by neighbour; 0: none
  };
  struct Message {
    int due = 0;  // round before whose updates the message arrives
    int round = 0;
    RobotId sender = 0;
    std::size_t receiver = 0;
    SentPoses poses;
  };

  void deliver(RoundMeter& meter);
  [[nodiscard]] bool may_move(const Robot& robot) const;
  void send(std::size_t k, RoundMeter& meter);

  AsynchronousOptions options_;
  std::mt19937 rng_;
  std::vector<Robot> robots_;
  std::vector<Message> messages_;
  int round_ = 0;
  std::size_t updates_ = 0;
};

}  // namespace km
