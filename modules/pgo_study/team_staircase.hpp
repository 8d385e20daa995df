#pragma once

#include <vector>

#include "modules/pgo_study/block_descent_team.hpp"
#include "modules/pgo_study/team_verification.hpp"

namespace km {

struct [[nodiscard]] TeamStaircase {
  std::vector<TeamRound> rounds;  ///< Of all ranks, verifications included in the work.
  LiftedPoses X;
  TeamVerification verification;  ///< Of X.
};

/// The Riemannian staircase of a team (Tian et al., TRO 2021): block descent from `start` as
/// `run` says, distributed verification, and if that finds a direction of negative curvature, on
/// along it one rank higher, until `max_rank`. How far to go along it the team decides by its cost,
/// whose sums are not counted.
TeamStaircase run_team_staircase(const TeamGraph& graph, LiftedPoses start,
                                 const BlockDescentOptions& descent, const TeamRunOptions& run,
                                 Eigen::Index max_rank, const TeamMeter& meter);

}  // namespace km
