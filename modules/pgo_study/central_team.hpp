#pragma once

#include <vector>

#include "modules/pgo_study/central_solver.hpp"
#include "modules/pgo_study/team_solver.hpp"

namespace km {

/// The reference: the whole graph on one computer, see CentralSolver. A round is one of its steps,
/// all work is robot 0's; what bringing the measurements together would cost in bytes is not
/// counted.
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
