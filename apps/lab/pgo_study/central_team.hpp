#pragma once

#include <vector>

#include "apps/lab/pgo_study/central_solver.hpp"
#include "apps/lab/pgo_study/team_solver.hpp"

namespace km {

/// Reference method: the whole graph on one computer, see CentralSolver. A round is one step of
/// CentralSolver, and all work counts for robot 0. The bytes for collecting the measurements are
/// not counted.
class CentralTeam : public TeamSolver {
 public:
  /// `start`: r x 4n, z up if the graph has verticals.
  CentralTeam(const TeamGraph& graph, const LiftedPoses& start,
              const StaircaseOptions& options = {});

  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return blocks_[robot];
  }
  [[nodiscard]] const CentralSolver& solver() const { return solver_; }

 private:
  void copy_blocks();

  std::vector<Eigen::Index> first_;
  CentralSolver solver_;
  std::vector<LiftedPoses> blocks_;
};

}  // namespace km
