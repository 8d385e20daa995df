#include "modules/rbcd/solver_choice.hpp"
#include "modules/session/session_schedule.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr std::uint32_t kFirst = 20, kAll = 40;  // keyframes of a robot: in the session, and later

// The part of the problem up to keyframe kFirst of each robot.
TeamProblem beginning(TeamProblem problem) {
  std::erase_if(problem.edges,
                [](const PoseEdge& e) { return std::max(e.from.index, e.to.index) >= kFirst; });
  return problem;
}

// Two robots after a session. Then robot 1 moves on and finds closures inside itself.
struct TwoRobots {
  TeamProblem problem = random_team_problem(
      {.robots = {1, 2},
       .pairs = std::vector<std::pair<RobotId, RobotId>>(12, std::pair<RobotId, RobotId>{1, 2}),
       .keyframes = kAll,
       .closures = 12},
      3);
  TeamNetwork network;
  SessionId session;
  std::size_t sent = 0;

  explicit TwoRobots(double refinement_period_s) {
    PoseGraphConfig config;
    config.barc = 8.0;  // no closure is false
    config.refinement_period_s = refinement_period_s;
    for (const RobotId id : {RobotId{1}, RobotId{2}})
      feed(network.add({id, 1}, config, solver_choice(config)), id, beginning(problem));
    REQUIRE(settle(network));
    session = network.agent(1).part()->session().id;
    sent = network.robots.at(1).session_bytes;
    TeamProblem inside = problem;
    std::erase_if(inside.edges, [](const PoseEdge& e) {
      return e.from.robot != 1 || e.to.robot != 1 || (is_step(e) && e.to.index < kFirst);
    });
    for (const PoseEdge& e : inside.edges) {
      if (!is_step(e)) continue;
      REQUIRE(network.agent(1).add(keyframe_after(e)));
    }
    feed_closures(network.agent(1), 1, inside, 2);
    (void)network.run(1.0);  // the next session waits for two seconds at rest
  }

  [[nodiscard]] bool is_before_next_session() {
    return network.agent(1).part()->session().id == session && !network.agent(1).in_session() &&
           network.robots.at(1).session_bytes == sent;
  }

  // Cost of all edges inside robot 1.
  [[nodiscard]] double own_cost(const std::vector<SE3>& poses) const {
    double cost = 0.0;
    for (const PoseEdge& e : problem.edges) {
      if (e.from.robot != 1 || e.to.robot != 1) continue;
      const double r = residual_of(e, poses[e.from.index], poses[e.to.index]);
      cost += r * r;
    }
    return cost;
  }
};

}  // namespace

TEST_CASE("between sessions a robot follows its new closures, without a message") {
  TwoRobots team(0.1);
  REQUIRE(team.is_before_next_session());
  const std::vector<SE3> refined = team.network.robots.at(1).trajectory->T_world_kf;
  REQUIRE(refined.size() == kAll);
  CHECK(team.network.robots.at(2).trajectory->T_world_kf.size() == kFirst);
  // Covariances are those of the published poses: the session has some, the refinement has none.
  CHECK(team.network.robots.at(2).trajectory->covariances.size() == kFirst);
  CHECK(team.network.robots.at(1).trajectory->covariances.empty());

  // The poses by odometry from the same keyframe.
  std::vector<SE3> extended(refined.begin(), refined.begin() + kFirst);
  for (const PoseEdge& e : team.problem.edges)
    if (is_step(e) && e.to.robot == 1 && e.to.index >= kFirst)
      extended.push_back(extended.back() * e.T_from_to);
  CAPTURE(team.own_cost(refined), team.own_cost(extended));
  CHECK(team.own_cost(refined) < 0.1 * team.own_cost(extended));
  // The optimum of the edges inside the robot: 39 steps and 12 closures have an expected cost of 72
  // (6 residuals each, less 6 for each of 39 free poses).
  CHECK(team.own_cost(refined) < 144.0);

  REQUIRE(settle(team.network));
  CHECK_FALSE(team.is_before_next_session());
  CHECK(team.network.robots.at(1).trajectory->T_world_kf.size() == kAll);
}

TEST_CASE("without refinements a robot keeps its poses until the next session") {
  TwoRobots team(0.0);
  REQUIRE(team.is_before_next_session());
  CHECK(team.network.robots.at(1).trajectory->T_world_kf.size() == kFirst);
}

TEST_CASE("refinements take at most a twentieth of the time") {
  RefinementSchedule schedule(5.0);
  CHECK_FALSE(schedule.is_due(0, 0.0));  // no closure
  CHECK(schedule.is_due(1, 0.0));
  schedule.began(1, 0.0);
  CHECK_FALSE(schedule.is_due(1, 2.0));  // it took two seconds
  CHECK_FALSE(schedule.is_due(2, 39.9));
  CHECK(schedule.is_due(2, 40.0));
  schedule.began(2, 40.0);
  CHECK_FALSE(schedule.is_due(3, 40.1));
  CHECK_FALSE(schedule.is_due(3, 44.9));
  CHECK(schedule.is_due(3, 45.0));
  schedule.used(3);  // by a session
  CHECK_FALSE(schedule.is_due(3, 60.0));
  CHECK_FALSE(RefinementSchedule(0.0).is_due(3, 60.0));
}

}  // namespace km
