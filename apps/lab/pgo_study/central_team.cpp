#include "apps/lab/pgo_study/central_team.hpp"

namespace km {

CentralTeam::CentralTeam(const TeamGraph& graph, const LiftedPoses& start,
                         const StaircaseOptions& options)
    : first_(graph.first),
      solver_(graph.edges, start, graph.dimension, options, graph.verticals),
      blocks_(graph.robots()) {
  copy_blocks();
}

int CentralTeam::step(RoundMeter& meter) {
  const bool stepped = meter.run(0, [&] { return solver_.step(); });
  copy_blocks();
  return stepped ? 1 : 0;
}

void CentralTeam::copy_blocks() {
  for (std::size_t k = 0; k < blocks_.size(); ++k)
    blocks_[k] = solver_.X().middleCols(4 * first_[k], 4 * (first_[k + 1] - first_[k]));
}

}  // namespace km
