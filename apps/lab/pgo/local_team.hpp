#pragma once

#include <vector>

#include "apps/lab/pgo/team_graph.hpp"
#include "apps/lab/pgo/team_solver.hpp"

namespace km {

/// Baseline without cooperation. Every robot solves its own graph alone (round 1). Then the frames
/// are joined along a tree of robots, one round per level of the tree. Each robot's frame is joined
/// to its parent's by one closure, the first by id. The joined frames are level if all robots have
/// verticals. Rank 3.
class LocalTeam : public TeamSolver {
 public:
  /// Throws std::invalid_argument, naming the robot, if the own edges of a robot do not connect its
  /// poses.
  explicit LocalTeam(const TeamGraph& graph);

  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }

 private:
  void solve(std::size_t k);
  void join(std::size_t k, RoundMeter& meter);

  std::vector<SessionGraph> parts_;
  bool upright_ = true;
  TeamTree tree_;
  std::vector<std::size_t> depth_;
  std::vector<LiftedPoses> blocks_;
  std::size_t round_ = 0;
};

}  // namespace km
