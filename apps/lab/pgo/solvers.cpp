#include "apps/lab/pgo/solvers.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "apps/lab/pgo/agent_team.hpp"
#include "apps/lab/pgo/member_team.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "modules/robust/lone_solution.hpp"
#include "modules/robust/tree_newton.hpp"
#include "modules/tree_newton/chordal.hpp"

namespace km {
namespace {

// The parameters with which one computer solves a whole graph: until rounding limits the cost.
TreeNewtonOptions central_options(const TeamGraph& graph) {
  constexpr double kPatience = 8.0;  // new second derivatives cost no messages
  return {.dimension = graph.dimension,
          .absolute_tolerance = 0.0,
          .patience_rounds = kPatience,
          .max_rounds = 300,
          .robust = false,
          .covariances = false};
}

std::vector<SE3> levelled_chordal(const TeamGraph& graph) {
  return levelled(chordal_initialisation(graph.poses(), graph.edges), graph.verticals);
}

// The frame of the pose T, rotated about `origin` by the smallest angle so that z is up.
SE3 levelled_frame(const SE3& T, const Eigen::Vector3d& origin) {
  const Eigen::MatrixXd levelled = level(T.matrix().topRows<3>(), origin);
  return make_pose(levelled.leftCols<3>(), levelled.col(3));
}

std::vector<SE3> moved(const SE3& T_to_from, std::vector<SE3> poses) {
  for (SE3& T : poses) T = T_to_from * T;
  return poses;
}

// Each robot solves its own graph alone. Then their frames are joined along a breadth-first tree
// from robot 0, each to that of its parent by the first closure between the two. They are level if
// all robots have verticals.
std::vector<SE3> solve_locally(const TeamGraph& graph, RoundMeter& meter) {
  std::vector<std::vector<PoseEdge>> closures;
  std::vector<std::vector<SE3>> poses;
  bool upright = true;
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    SessionGraph part = part_of(graph, k);
    std::erase_if(part.own, is_unknown_step);  // no measurement of this robot
    part.odometry = 0;
    part.upright = !part.verticals.empty();
    upright = upright && part.upright;
    closures.push_back(std::exchange(part.between, {}));
    try {
      part.start = levelled(chordal_initialisation(graph.poses_of(k), part.own), part.verticals);
    } catch (const std::invalid_argument&) {
      throw std::invalid_argument("robot " + std::to_string(k) +
                                  " cannot solve alone: its own edges do not connect its poses");
    }
    poses.push_back(meter.run(k, [&] { return solve_alone(part, central_options(graph)).poses; }));
  }
  std::vector<RobotId> order{0};
  for (std::size_t at = 0; at < order.size(); ++at)
    for (const PoseEdge& e : closures[order[at]]) {
      const RobotId parent = order[at];
      const KeyframeId& other = e.other(parent);
      if (std::ranges::find(order, other.robot) != order.end()) continue;
      order.push_back(other.robot);
      meter.sent(kPoseBytes);
      meter.run(other.robot, [&] {
        const SE3 T_parent_other = e.from.robot == parent ? e.T_from_to : e.T_from_to.inverse();
        const SE3& T_frame_other = poses[other.robot][other.index];
        SE3 T_world_frame =
            poses[parent][e.end_on(parent).index] * T_parent_other * T_frame_other.inverse();
        if (upright) T_world_frame = levelled_frame(T_world_frame, T_frame_other.translation());
        poses[other.robot] = moved(T_world_frame, std::move(poses[other.robot]));
      });
    }
  std::vector<SE3> all;
  for (const auto& of_robot : poses) all.insert(all.end(), of_robot.begin(), of_robot.end());
  return all;
}

SolverRun run_locally(const TeamGraph& graph, const std::vector<SE3>& start,
                      const TeamMeter& meter) {
  SolverRun run{.rounds = {}, .poses = start, .decision = {}};
  bool done = false;
  run.rounds = run_rounds(
      graph, [&] { return run.poses; },
      [&](RoundMeter& round) {
        if (std::exchange(done, true)) return 0;
        run.poses = solve_locally(graph, round);
        return 1;
      },
      1, meter);
  return run;
}

// The whole graph on one computer. All work counts for robot 0. The bytes for collecting the
// measurements are not counted.
SolverRun run_centrally(const TeamGraph& graph, const std::vector<SE3>& start,
                        const SolverOptions& options, const TeamMeter& meter) {
  TreeNewton newton(whole_session(graph, start), TreePlace{.members = {0}}, central_options(graph));
  SolverRun run;
  run.rounds = run_rounds(
      graph, [&] { return newton.poses(); },
      [&](RoundMeter& round) {
        if (newton.done()) return 0;
        round.run(0, [&] { (void)newton.advance(); });  // a team of one sends no messages
        return 1;
      },
      options.max_rounds, meter);
  run.poses = newton.poses();
  return run;
}

SolverRun run_members(const TeamGraph& graph, const std::vector<SE3>& start,
                      const MemberTeam::Factory& make, int max_rounds, const TeamMeter& meter) {
  MemberTeam team(graph, start, make);
  SolverRun run;
  run.rounds = run_team(graph, team, max_rounds, meter);
  run.poses = team.poses();
  return run;
}

// The robots' own block descent, with their own stopping rule.
SolverRun run_rbcd(const TeamGraph& graph, const std::vector<SE3>& start,
                   const SolverOptions& options, const TeamMeter& meter) {
  const RbcdOptions rbcd{.max_rounds = static_cast<std::uint32_t>(options.max_rounds),
                         .max_over_relaxation = options.over_relaxation};
  return run_members(
      graph, start,
      [rbcd](SessionGraph part, const TreePlace& place) {
        return std::make_unique<MemberRbcd>(std::move(part), place, rbcd);
      },
      options.max_rounds, meter);
}

// The members of one session that trust all closures.
SolverRun run_trusting(const TeamGraph& graph, const std::vector<SE3>& start,
                       const SolverOptions& options, const TeamMeter& meter) {
  TreeNewtonOptions newton = newton_options({.robust = false});
  newton.dimension = graph.dimension;
  newton.absolute_tolerance = 1e-12;
  return run_members(
      graph, start,
      [newton](SessionGraph part, TreePlace place) {
        return std::make_unique<TreeNewton>(std::move(part), std::move(place), newton);
      },
      options.max_rounds, meter);
}

// The robots' own code from measurements to published poses, over an ideal network.
SolverRun run_agents(const TeamGraph& graph, const SolverOptions& options, const TeamMeter& meter) {
  AgentTeamOptions team{.meter = meter};
  team.pose_graph.max_rounds = options.max_rounds;
  team.pcm.witness_wait_s = 0.0;
  AgentTeamRun robots = run_agent_team(graph, team);
  TeamRound end{.round = static_cast<int>(robots.last.round),
                .cost = robots.last.cost,
                .gradient_norm = robots.last.gradient,
                .work = {.bytes = robots.bytes, .critical_path_s = robots.critical_path_s}};
  Decision decision{.kept = std::move(robots.kept),
                    .world_of = std::move(robots.world_of),
                    .noise_scale = robots.last.noise_scale,
                    .threshold = robots.last.barc,
                    .decided = robots.settled && end.round < options.max_rounds};
  for (const AgentCost& cost : robots.costs) {
    end.work.total_cpu_s += cost.cpu_s;
    decision.most_sent = std::max(decision.most_sent, cost.sent);
    decision.most_received = std::max(decision.most_received, cost.received);
  }
  return {{end}, std::move(robots.T_world_kf), std::move(decision)};
}

}  // namespace

SolverRun run_solver(const TeamGraph& graph, const std::vector<SE3>& start,
                     const SolverOptions& options, const TeamMeter& meter) {
  if (options.rejects()) return run_agents(graph, options, meter);
  if (options.method == "newton") return run_trusting(graph, start, options, meter);
  if (options.method == "local") return run_locally(graph, start, meter);
  if (options.method == "rbcd") return run_rbcd(graph, start, options, meter);
  if (options.method == "centralized") return run_centrally(graph, start, options, meter);
  throw std::invalid_argument("unknown method " + options.method);
}

CentralOptimum central_optimum(const TeamGraph& graph, const std::vector<SE3>& start) {
  std::vector<SE3> poses = solve_alone(whole_session(graph, start), central_options(graph)).poses;
  const QuadraticProblem problem = problem_of(graph, 3);
  const LiftedPoses X = lift(poses, 3);
  const SE3 T_first_world = poses.front().inverse();
  return {moved(T_first_world, std::move(poses)), problem.cost(X), certify(problem, X)};
}

CentralOptimum central_optimum(const TeamGraph& graph) {
  return central_optimum(graph, levelled_chordal(graph));
}

TeamMeter cpu_meter() {
  return {.cpu_s = thread_cpu_s};
}

Solution solve(const TeamGraph& graph, const SolverOptions& options, const TeamMeter& meter) {
  Solution solution{.method = options.name()};
  std::vector<SE3> start;
  if (!options.rejects()) {
    const double begin_s = meter.cpu_s();
    start = levelled_chordal(graph);
    solution.start_s = meter.cpu_s() - begin_s;
  }
  solution.run = run_solver(graph, start, options, meter);
  const std::vector<SE3>& poses = solution.run.poses;
  SE3 T_world_first = poses.front();
  if (!graph.verticals.empty())
    T_world_first = levelled_frame(T_world_first, Eigen::Vector3d::Zero());
  solution.T_world_kf = moved(T_world_first.inverse(), poses);
  if (options.rejects()) return solution;
  const CentralOptimum least = central_optimum(graph, start);
  const QuadraticProblem problem = problem_of(graph, 3);
  solution.comparison =
      OptimumComparison{.rounded_cost = problem.cost(lift(solution.T_world_kf, 3)),
                        .optimum = least.cost,
                        .optimum_certified = least.certificate.certified,
                        .certificate = certify(problem, lift(poses, 3))};
  return solution;
}

}  // namespace km
