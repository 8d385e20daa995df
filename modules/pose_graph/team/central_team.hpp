#pragma once

#include <vector>

#include "modules/pose_graph/staircase.hpp"
#include "modules/pose_graph/team/team_solver.hpp"

namespace km {

/// The reference: the whole graph on one computer by the Riemannian staircase. A round is one of
/// its steps, all work is robot 0's; what bringing the measurements together would cost in bytes is
/// not counted.
class CentralTeam : public TeamSolver {
 public:
  /// `start`: r x 4n, z up if the graph has verticals.
  CentralTeam(const TeamGraph& graph, const LiftedPoses& start,
              const StaircaseOptions& options = {});

  bool step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }
  [[nodiscard]] const Staircase& staircase() const { return staircase_; }

 private:
  void copy_blocks();

  std::vector<Eigen::Index> first_;
  Staircase staircase_;
  std::vector<LiftedPoses> blocks_;
};

}  // namespace km
