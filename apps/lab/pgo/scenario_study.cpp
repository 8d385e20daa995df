#include "apps/lab/pgo/scenario_study.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "apps/lab/pgo_study/agent_team.hpp"
#include "apps/lab/pgo_study/connected_parts.hpp"
#include "apps/lab/pgo_study/odometry_start.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/outlier_rejection/chi_squared.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/lone_solution.hpp"
#include "modules/pose_graph/robust_schedule.hpp"
#include "modules/pose_graph/tree_front.hpp"
#include "modules/rbcd/rounding.hpp"

namespace km {
namespace {

using Eigen::Index;

std::vector<ConnectedPart> parts_of(const TeamGraph& graph, const std::vector<bool>& kept) {
  return connected_parts(graph, std::vector<bool>(graph.ids.size(), true), kept);
}

// Chordal initialisation of each connected part of the `kept` edges.
std::vector<SE3> chordal_start(const TeamGraph& graph, const std::vector<bool>& kept) {
  std::vector<SE3> start(static_cast<std::size_t>(graph.poses()));
  for (const ConnectedPart& part : parts_of(graph, kept)) {
    const auto poses = chordal_initialisation(part.graph.poses(), part.graph.edges);
    for (std::size_t k = 0; k < poses.size(); ++k) start[part.poses[k]] = poses[k];
  }
  return start;
}

double residual(const BlockEdge& e, const std::vector<SE3>& poses) {
  return residual_of(edge_of_one_robot(e), poses[static_cast<std::size_t>(e.i)],
                     poses[static_cast<std::size_t>(e.j)]);
}

TeamGraph with_weights(const TeamGraph& graph, const std::vector<double>& weights) {
  TeamGraph weighed = graph;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    weighed.edges[k].kappa *= weights[k];
    weighed.edges[k].tau *= weights[k];
  }
  return weighed;
}

PlacedTeam solve_by_robots(const TeamGraph& graph, double keyframes_per_s, double threshold) {
  AgentTeamRun run = run_agent_team(
      graph, {.pose_graph = {.barc = threshold}, .keyframes_per_s = keyframes_per_s});
  PlacedTeam placed{.T_frame_kf = std::move(run.T_world_kf),
                    .frame_of = {},
                    .kept = std::move(run.kept),
                    .decided = run.settled,
                    .tentative = static_cast<std::size_t>(std::ranges::count(run.tentative, true))};
  for (std::size_t robot = 0; robot < graph.robots(); ++robot)
    placed.frame_of.insert(placed.frame_of.end(), static_cast<std::size_t>(graph.poses_of(robot)),
                           run.world_of[robot]);
  return placed;
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

bool has_threshold(const std::string& method) {
  return method == "robots" || method == "pcm" || method == "gnc";
}

PlacedTeam solve_by(const std::string& method, const ScenarioGraph& drawn,
                    const ScenarioStudyOptions& options, double threshold) {
  const TeamGraph& graph = drawn.graph;
  if (method == "robots") return solve_by_robots(graph, options.keyframes_per_s, threshold);
  if (method == "reference") return solve_reference(drawn);
  if (method == "gnc") return solve_by_gnc(graph, threshold);
  std::vector<bool> kept(graph.edges.size(), true);
  PcmConfig pcm = options.pcm;
  if (threshold > 0.0)
    pcm.confidence = std::clamp(chi_squared_6(threshold * threshold), 0.01, 1.0 - 1e-12);
  if (method == "pcm")
    kept = pairwise_consistent(graph, pcm);
  else if (method != "trust-all")
    throw std::invalid_argument("scenario study: unknown method " + method);
  std::vector<SE3> start = chordal_start(graph, kept);
  return solve_centrally(graph, std::move(kept), std::move(start));
}

}  // namespace

PlacedTeam solve_centrally(const TeamGraph& graph, std::vector<bool> kept, std::vector<SE3> start,
                           std::uint32_t most_steps) {
  PlacedTeam placed{.T_frame_kf = std::move(start), .frame_of = {}, .kept = std::move(kept)};
  placed.frame_of = part_of_poses(with_edges(graph, placed.kept));
  for (const ConnectedPart& part : parts_of(graph, placed.kept)) {
    SessionGraph alone;
    for (const std::size_t i : part.poses) alone.start.push_back(placed.T_frame_kf[i]);
    for (const BlockEdge& e : part.graph.edges) alone.own.push_back(edge_of_one_robot(e));
    const LoneSolution solved = solve_alone(std::move(alone), {.dimension = graph.dimension,
                                                               .absolute_tolerance = 1e-12,
                                                               .max_rounds = most_steps,
                                                               .robust = false});
    placed.decided = placed.decided && solved.converged;
    for (std::size_t k = 0; k < part.poses.size(); ++k)
      placed.T_frame_kf[part.poses[k]] = solved.poses[k];
  }
  return placed;
}

PlacedTeam solve_by_gnc(const TeamGraph& graph, double threshold) {
  constexpr double kConfidence = 0.99;
  constexpr double kSteeper = 1.4;   // as the paper recommends
  constexpr double kFloor = 1e-10;   // keeps the equations regular
  constexpr int kMostUpdates = 100;  // as in the paper
  constexpr std::uint32_t kStepsOfUpdate = 20;
  const double c2 = threshold > 0.0 ? threshold * threshold : chi_squared_6_quantile(kConfidence);
  const std::vector<bool> odometry = odometry_edges(graph);
  const std::vector<bool> all(graph.edges.size(), true);
  const bool joined = std::ranges::count(part_of_poses(graph), 0) == graph.poses();
  PlacedTeam placed =
      solve_centrally(graph, all, joined ? odometry_start(graph) : chordal_start(graph, all));
  double largest = 0.0;
  for (std::size_t k = 0; k < odometry.size(); ++k)
    if (!odometry[k]) largest = std::max(largest, residual(graph.edges[k], placed.T_frame_kf));
  double mu = first_mu(largest * largest, c2);
  std::vector<double> weights(graph.edges.size(), 1.0);
  bool decided = false;
  for (int update = 0; update < kMostUpdates && !decided; ++update, mu *= kSteeper) {
    decided = true;
    for (std::size_t k = 0; k < odometry.size(); ++k) {
      if (odometry[k]) continue;
      const double r = residual(graph.edges[k], placed.T_frame_kf);
      const double weight = std::max(kFloor, robust_weight(r * r, c2, mu));
      decided = decided && (weight == 1.0 || weight == kFloor);
      weights[k] = weight;
    }
    PlacedTeam next =
        solve_centrally(with_weights(graph, weights), all, placed.T_frame_kf, kStepsOfUpdate);
    placed.T_frame_kf = std::move(next.T_frame_kf);
  }
  for (std::size_t k = 0; k < odometry.size(); ++k) placed.kept[k] = weights[k] > 0.5;
  PlacedTeam end = solve_centrally(graph, placed.kept, placed.T_frame_kf);
  end.decided = end.decided && decided;
  return end;
}

ScenarioResult judge(const ScenarioGraph& drawn, const PlacedTeam& placed) {
  ScenarioResult result{.decided = placed.decided};
  const TeamGraph& graph = drawn.graph;
  const std::vector<bool> odometry = odometry_edges(graph);
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    if (odometry[k]) continue;
    if (drawn.is_false[k]) {
      ++result.false_closures;
      if (placed.kept[k]) ++result.false_kept;
      continue;
    }
    const bool between = graph.robot_of(graph.edges[k].i) != graph.robot_of(graph.edges[k].j);
    ++result.true_closures;
    if (between) ++result.between;
    if (placed.kept[k]) continue;
    ++result.true_lost;
    if (between) ++result.between_lost;
  }
  std::map<Index, std::vector<PosePair>> frames;
  for (std::size_t i = 0; i < drawn.truth.size(); ++i)
    frames[placed.frame_of[i]].push_back(
        {static_cast<Stamp>(i), drawn.truth[i], placed.T_frame_kf[i]});
  std::vector<double> errors;
  for (const auto& [frame, pairs] : frames) {
    const std::vector<double> of_frame = aligned_errors_m(pairs);
    errors.insert(errors.end(), of_frame.begin(), of_frame.end());
  }
  const Statistics statistics = statistics_of(std::move(errors));
  result.frames = frames.size();
  result.tentative = placed.tentative;
  result.rms_m = statistics.rmse;
  result.max_m = statistics.max;
  return result;
}

ScenarioStudy run_scenario_study(const TeamGraph& whole, const ScenarioStudyOptions& options,
                                 const TeamMeter& meter, const OutlierProgress& progress) {
  const CentralOptimum central = central_optimum(whole);
  const std::vector<SE3> optimum = round_to_poses(central.X, central.X.leftCols<4>());
  ScenarioStudy study{
      .scenario = options.scenario.name, .certified = central.certified, .results = {}};
  const std::vector<double> none = {0.0};
  std::size_t all = 0;
  for (const std::string& method : options.methods)
    all += options.seeds.size() * (has_threshold(method) ? options.thresholds.size() : 1);
  for (const unsigned seed : options.seeds) {
    const ScenarioGraph drawn = draw_scenario(whole, optimum, options.scenario, seed);
    study.robots = drawn.graph.robots();
    study.poses = drawn.truth.size();
    for (const std::string& method : options.methods) {
      for (const double threshold : has_threshold(method) ? options.thresholds : none) {
        if (progress) progress(study.results.size(), all);
        const double begin_s = meter.cpu_s();
        const PlacedTeam placed = solve_by(method, drawn, options, threshold);
        const double cpu_s = meter.cpu_s() - begin_s;
        ScenarioResult result = judge(drawn, placed);
        result.method = method;
        result.seed = seed;
        result.threshold = threshold;
        result.cpu_s = cpu_s;
        study.results.push_back(std::move(result));
      }
    }
  }
  if (progress) progress(all, all);
  return study;
}

}  // namespace km
