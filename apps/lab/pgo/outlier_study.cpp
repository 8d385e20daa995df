#include "apps/lab/pgo/outlier_study.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include "apps/lab/pgo/agent_team.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo/team_graph.hpp"
#include "apps/lab/pgo/truth_score.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "modules/robust/lone_solution.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "modules/tree_newton/tree_front.hpp"

namespace km {
namespace {

using Eigen::Index;

// Chordal initialisation of each connected part of the `kept` edges.
std::vector<SE3> chordal_start(const TeamGraph& graph, const std::vector<bool>& kept) {
  std::vector<SE3> start(static_cast<std::size_t>(graph.poses()));
  for (const ConnectedPart& part : connected_parts(graph, kept)) {
    const auto poses = chordal_initialisation(part.graph.poses(), part.graph.edges);
    for (std::size_t k = 0; k < poses.size(); ++k) start[part.poses[k]] = poses[k];
  }
  return start;
}

PlacedTeam solve_reference(const ScenarioGraph& drawn) {
  TeamGraph honest = drawn.graph;
  std::vector<bool> kept;
  for (std::size_t k = 0; k < honest.edges.size(); ++k) {
    honest.edges[k].kappa = drawn.honest[k].kappa;
    honest.edges[k].tau = drawn.honest[k].tau;
    kept.push_back(!drawn.is_false[k]);
  }
  return solve_centrally(honest, std::move(kept), drawn.truth);
}

PlacedTeam solve_by_robots(const TeamGraph& graph) {
  AgentTeamRun run = run_agent_team(graph, {});
  PlacedTeam placed{.T_frame_kf = std::move(run.T_world_kf),
                    .frame_of = {},
                    .kept = std::move(run.kept),
                    .decided = run.settled,
                    .rounds = run.rounds,
                    .bytes = run.bytes};
  for (std::size_t robot = 0; robot < graph.robots(); ++robot)
    placed.frame_of.insert(placed.frame_of.end(), static_cast<std::size_t>(graph.poses_of(robot)),
                           run.world_of[robot]);
  return placed;
}

PlacedTeam solve_by(const std::string& method, const ScenarioGraph& drawn,
                    const OutlierStudyOptions& options) {
  const TeamGraph& graph = drawn.graph;
  if (method == "reference") return solve_reference(drawn);
  if (method == "robots") return solve_by_robots(graph);
  std::vector<bool> kept(graph.edges.size(), true);
  if (method == "pcm")
    kept = pairwise_consistent(graph, options.pcm);
  else if (method != "trust-all")
    throw std::invalid_argument("outlier study: unknown method " + method);
  std::vector<SE3> start = chordal_start(graph, kept);
  return solve_centrally(graph, std::move(kept), std::move(start));
}

}  // namespace

std::vector<bool> pairwise_consistent(const TeamGraph& graph, const PcmConfig& config) {
  std::vector<bool> kept = odometry_edges(graph);
  std::map<std::pair<RobotId, RobotId>, Pcm> pairs;
  std::map<ClosureId, std::size_t> edge_of;
  for (const auto& [edge, closure] : team_closures(graph)) {
    if (kept[edge] || !edge_of.emplace(closure.id(), edge).second) continue;
    const auto [a, b] = std::minmax({closure.from.id.robot, closure.to.id.robot});
    Pcm& pcm = pairs.try_emplace({a, b}, a, b, config).first->second;
    (void)pcm.add(closure);
  }
  for (const auto& [pair, pcm] : pairs)
    for (const ClosureId& id : pcm.inliers()) kept[edge_of.at(id)] = true;
  return kept;
}

PlacedTeam solve_centrally(const TeamGraph& graph, std::vector<bool> kept, std::vector<SE3> start) {
  // Exact measurements have huge weights, with which rounding predicts decreases of 1e-10.
  constexpr double kEnd = 1e-9;
  PlacedTeam placed{.T_frame_kf = std::move(start), .frame_of = {}, .kept = std::move(kept)};
  placed.frame_of = part_of_poses(with_edges(graph, placed.kept));
  for (const ConnectedPart& part : connected_parts(graph, placed.kept)) {
    std::vector<SE3> from;
    for (const std::size_t i : part.poses) from.push_back(placed.T_frame_kf[i]);
    const LoneSolution solved =
        solve_alone(whole_session(part.graph, std::move(from)), {.dimension = graph.dimension,
                                                                 .absolute_tolerance = kEnd,
                                                                 .max_rounds = 300,
                                                                 .robust = false});
    placed.decided = placed.decided && solved.converged;
    for (std::size_t k = 0; k < part.poses.size(); ++k)
      placed.T_frame_kf[part.poses[k]] = solved.poses[k];
  }
  return placed;
}

OutlierResult judge(const ScenarioGraph& drawn, const PlacedTeam& placed) {
  OutlierResult result{.rounds = placed.rounds, .bytes = placed.bytes, .decided = placed.decided};
  const auto [inside, between] = count_closures(drawn.graph, drawn.is_false, placed.kept);
  result.true_closures = inside.all_true() + between.all_true();
  result.true_lost = inside.true_lost + between.true_lost;
  result.between = between.all_true();
  result.between_lost = between.true_lost;
  result.false_kept = inside.false_kept + between.false_kept;
  result.false_closures = result.false_kept + inside.false_rejected + between.false_rejected;
  std::map<Index, std::vector<PosePair>> frames;
  for (std::size_t i = 0; i < drawn.truth.size(); ++i)
    frames[placed.frame_of[i]].push_back(
        {static_cast<Stamp>(i), drawn.truth[i], placed.T_frame_kf[i]});
  std::vector<double> errors;
  for (const auto& [frame, pairs] : frames)
    std::ranges::copy(aligned_errors_m(pairs), std::back_inserter(errors));
  const Statistics statistics = statistics_of(std::move(errors));
  result.frames = frames.size();
  result.rms_m = statistics.rmse;
  result.max_m = statistics.max;
  return result;
}

OutlierStudy run_outlier_study(const TeamGraph& clean, const OutlierStudyOptions& options,
                               const TeamMeter& meter, const OutlierProgress& progress) {
  const Scenario scenario = options.scenario.value_or(Scenario{});
  std::vector<double> shares = options.shares_percent;
  if (shares.empty()) shares = {scenario.random_percent};
  for (const double percent : shares)
    if (!(percent >= 0.0 && std::isfinite(percent)))
      throw std::invalid_argument("outlier study: a share of " + std::to_string(percent) + " %");
  const CentralOptimum central = central_optimum(clean);
  const std::vector<SE3>& optimum = central.poses;
  OutlierStudy study{
      .scenario = scenario.name, .certified = central.certificate.certified, .results = {}};
  const std::size_t all = shares.size() * options.methods.size() * options.seeds.size();
  for (const double percent : shares)
    for (const std::string& method : options.methods)
      for (const unsigned seed : options.seeds) {
        if (progress) progress(study.results.size(), all);
        Scenario with_share = scenario;
        with_share.random_percent = percent;
        const ScenarioGraph drawn = options.scenario
                                        ? draw_scenario(clean, optimum, with_share, seed)
                                        : as_measured(clean, optimum, percent, seed);
        study.robots = drawn.graph.robots();
        study.poses = drawn.truth.size();
        const double begin_s = meter.cpu_s();
        const PlacedTeam placed = solve_by(method, drawn, options);
        const double cpu_s = meter.cpu_s() - begin_s;
        OutlierResult& result = study.results.emplace_back(judge(drawn, placed));
        result.method = method;
        result.share_percent = percent;
        result.seed = seed;
        result.cpu_s = cpu_s;
      }
  if (progress) progress(all, all);
  return study;
}

}  // namespace km
