#include "modules/pose_graph/odometry_judgement.hpp"

namespace km {

void OdometryJudgement::correct(std::span<PoseEdge> steps) const {
  for (PoseEdge& step : steps) step.precision = noise.corrected(step.precision);
  correct_breaks(steps, breaks);
}

OdometryJudgement judge_odometry(std::span<const PoseEdge> steps,
                                 std::span<const PoseEdge> closures) {
  OdometryJudgement judgement{.breaks = find_odometry_breaks(steps, closures)};
  std::vector<PoseEdge> repaired(steps.begin(), steps.end());
  correct_breaks(repaired, judgement.breaks);
  judgement.noise = estimate_odometry_noise(repaired, closures);
  return judgement;
}

}  // namespace km
