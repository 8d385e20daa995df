#include "modules/pgo_study/team_staircase.hpp"

#include "modules/pgo_study/certificate.hpp"

namespace km {

TeamStaircase run_team_staircase(const TeamGraph& graph, LiftedPoses start,
                                 const BlockDescentOptions& descent, const TeamRunOptions& run,
                                 Eigen::Index max_rank, const TeamMeter& meter) {
  TeamStaircase result;
  TeamWork before;
  for (;;) {
    BlockDescentTeam team(graph, start, descent);
    for (TeamRound round : run_team(graph, team, run, meter)) {
      round.work += before;
      result.rounds.push_back(round);
    }
    result.X = team_poses(graph, team);
    result.verification = verify_team(graph, result.X, {}, meter);
    result.rounds.back().work += result.verification.work;
    before = result.rounds.back().work;
    if (!result.verification.negative || result.X.rows() >= max_rank) return result;
    const QuadraticProblem higher(result.X.rows() + 1, graph.poses(), graph.edges, {});
    start = escape(higher, result.X, result.verification.direction.row(0).transpose());
  }
}

}  // namespace km
