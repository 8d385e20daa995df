#include "apps/lab/pgo/round_meter.hpp"

namespace km {

std::vector<TeamRound> run_rounds(const TeamGraph& graph,
                                  const std::function<std::vector<SE3>()>& poses,
                                  const std::function<int(RoundMeter&)>& step, int max_rounds,
                                  const TeamMeter& meter) {
  const QuadraticProblem whole = problem_of(graph, 3);
  RoundMeter round_meter(graph.robots(), meter);
  std::vector<TeamRound> rounds;
  TeamWork work;
  const auto record = [&](int round) {
    const LiftedPoses X = lift(poses(), 3);
    rounds.push_back(
        {round, whole.cost(X), project_tangent(X, whole.euclidean_gradient(X)).norm(), work});
  };
  record(0);
  for (int round = 0; round < max_rounds;) {
    const int made = step(round_meter);
    if (made == 0) break;
    round += made;
    work += round_meter.finish_round();
    record(round);
  }
  return rounds;
}

}  // namespace km
