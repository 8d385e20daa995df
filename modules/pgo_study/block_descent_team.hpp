#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "modules/pgo_study/descent_block.hpp"
#include "modules/pgo_study/team_solver.hpp"

namespace km {

enum class BlockSchedule {
  /// Robots without common edges have one colour and update together; colours take turns.
  kColoured,
  /// The robot with the largest gradient norm updates, the others tell theirs again: two exchanges
  /// in each round (Tian et al., TRO 2021).
  kGreedy,
};

struct BlockDescentOptions {
  BlockSchedule schedule = BlockSchedule::kColoured;
  double max_over_relaxation = 1.95;  ///< See DescentBlock::update(); 1: as published.
  /// Nesterov's acceleration, restarted when the team's cost has risen over a sweep; takes the
  /// place of over-relaxation. Coloured only.
  bool accelerated = false;
  TruncatedNewtonOptions block_update = {};
};

/// Riemannian block-coordinate descent (Tian et al., "Distributed Certifiably Correct Pose-Graph
/// Optimization", TRO 2021; accelerated as its RBCD++). The first round tells all public poses.
class BlockDescentTeam : public TeamSolver {
 public:
  /// `start`: feasible poses of the whole graph, r x 4n, z up if it has verticals. Throws
  /// std::invalid_argument if acceleration is asked of the greedy schedule.
  BlockDescentTeam(const TeamGraph& graph, const LiftedPoses& start,
                   const BlockDescentOptions& options);

  bool step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return robots_[robot].block.X();
  }

 private:
  struct Heard {  // accelerated only
    std::size_t robot;
    ToldBlock X;
    ToldBlock V;
  };
  struct Robot {
    DescentBlock block;
    std::vector<std::size_t> neighbours;
    std::set<RobotId> earlier;  // their edges are counted by the later robot
    double gradient_norm;       // as last told
    double cost;                // share of the team's, as last told
    LiftedPoses X;              // accelerated: the block itself is at Y
    LiftedPoses V;
    std::vector<Heard> heard;
  };

  void open(RoundMeter& meter);
  void tell(std::size_t k, RoundMeter& meter);
  void tell_gradients(const std::vector<std::size_t>& robots, RoundMeter& meter);
  void step_greedy(RoundMeter& meter);
  void step_coloured(RoundMeter& meter);
  void step_accelerated(RoundMeter& meter);
  void mix_all(double alpha, RoundMeter& meter);
  void tell_accelerated(std::size_t k, RoundMeter& meter);
  void restart_if_risen(RoundMeter& meter);

  BlockDescentOptions options_;
  std::vector<Robot> robots_;
  std::vector<std::vector<std::size_t>> colours_;
  std::uint32_t round_ = 0;  // of exchange
  std::size_t turn_ = 0;     // colour
  std::uint32_t sweep_ = 0;
  double gamma_ = 0.0;
  double last_cost_ = 0.0;  // of the team, a sweep ago
};

}  // namespace km
