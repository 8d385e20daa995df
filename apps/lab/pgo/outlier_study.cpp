#include "apps/lab/pgo/outlier_study.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <utility>

#include "apps/lab/pgo_study/team_closures.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "modules/outlier_rejection/random_outliers.hpp"
#include "modules/rbcd/rounding.hpp"

namespace km {
std::vector<bool> pairwise_consistent(const TeamGraph& graph, const PcmConfig& config,
                                      double noise_scale) {
  std::vector<bool> kept = odometry_edges(graph);
  std::map<std::pair<RobotId, RobotId>, Pcm> pairs;
  std::map<ClosureId, std::size_t> edge_of;
  for (const TeamClosure& measured : team_closures(graph, noise_scale)) {
    const Closure& closure = measured.closure;
    if (kept[measured.edge] || !edge_of.emplace(closure.id(), measured.edge).second) continue;
    const auto [a, b] = std::minmax({closure.from.id.robot, closure.to.id.robot});
    Pcm& pcm = pairs.try_emplace({a, b}, a, b, config).first->second;
    (void)pcm.add(closure);
  }
  for (const auto& [pair, pcm] : pairs)
    for (const ClosureId& id : pcm.inliers()) kept[edge_of.at(id)] = true;
  return kept;
}

namespace {

double rmse_m(const std::vector<SE3>& truth, const std::vector<SE3>& estimate) {
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < truth.size(); ++i)
    pairs.push_back({static_cast<Stamp>(i), truth[i], estimate[i]});
  return statistics_of(aligned_errors_m(pairs)).rmse;
}

// Runs one method on a graph whose edges from index `own_edges` on are false closures.
OutlierResult attempt(const std::string& method, const TeamGraph& graph, std::size_t own_edges,
                      const std::vector<SE3>& truth, const OutlierStudyOptions& options,
                      const TeamMeter& meter) {
  const bool by_pcm = method.starts_with("pcm");
  const bool rejects = method.ends_with("newton");
  const std::vector<bool> odometry = odometry_edges(graph);
  OutlierResult result{.method = method};
  std::vector<bool> kept(graph.edges.size(), true);
  const double begin_s = meter.cpu_s();
  if (by_pcm) kept = pairwise_consistent(graph, options.pcm, options.pcm_sigmas);
  const double pcm_s = meter.cpu_s() - begin_s;

  const TeamGraph part = with_edges(graph, kept);
  const SolverRun run = run_solver(part, {},
                                   {.method = "newton",
                                    .run = {.max_rounds = options.max_rounds},
                                    .trust_all = !rejects,
                                    .barc = options.barc},
                                   meter);
  result.rmse_m = rmse_m(truth, round_to_poses(run.X, run.X.leftCols<4>()));
  result.rounds = run.rounds.back().round;
  result.decided = run.decision->decided;
  result.noise_scale = run.decision->noise_scale;
  result.bytes = run.rounds.back().work.bytes;
  result.cpu_s = pcm_s + run.rounds.back().work.total_cpu_s;
  std::size_t in_part = 0;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!kept[k]) continue;
    const bool stays = !rejects || run.decision->kept[in_part];
    ++in_part;
    if (stays && !odometry[k]) ++(k >= own_edges ? result.false_kept : result.true_kept);
  }
  return result;
}

}  // namespace

std::vector<double> aligned_errors_m(std::span<const PosePair> pairs) {
  const Alignment alignment = align(pairs, false);
  std::vector<double> errors;
  for (const PosePair& pair : pairs)
    errors.push_back(
        (pair.T_truth_body.translation() - alignment.apply(pair.T_estimate_body).translation())
            .norm());
  return errors;
}

double half_extent_m(const std::vector<SE3>& poses) {
  Eigen::AlignedBox3d box;
  for (const SE3& T : poses) box.extend(T.translation());
  return 0.5 * box.sizes().maxCoeff();
}

TeamGraph corrupt(const TeamGraph& graph, std::size_t count, double half_side_m, unsigned seed) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<std::size_t> closures;
  for (std::size_t k = 0; k < odometry.size(); ++k)
    if (!odometry[k]) closures.push_back(k);
  if (closures.empty()) throw std::invalid_argument("corrupt: the graph has no loop closure");
  TeamGraph corrupted = graph;
  std::mt19937 rng(seed);
  const RandomOutlierModel model{.keyframes = static_cast<std::size_t>(graph.poses()),
                                 .planar = graph.dimension == 2,
                                 .half_side_m = half_side_m};
  std::uniform_int_distribution<std::size_t> closure(0, closures.size() - 1);
  // Each pair of poses gets at most one closure, because parallel edges would share one verdict.
  std::set<std::pair<Eigen::Index, Eigen::Index>> taken;
  for (const BlockEdge& e : graph.edges) taken.insert(std::minmax(e.i, e.j));
  const auto poses = static_cast<std::size_t>(graph.poses());
  if (2 * (taken.size() + count) > poses * (poses - 1))
    throw std::invalid_argument("corrupt: " + std::to_string(poses) + " poses are too few for " +
                                std::to_string(count) + " false closures");
  while (corrupted.edges.size() < graph.edges.size() + count) {
    const RelativePose e = random_outliers(1, model, rng).front();
    const auto i = static_cast<Eigen::Index>(e.from.index);
    const auto j = static_cast<Eigen::Index>(e.to.index);
    if (!taken.insert(std::minmax(i, j)).second) continue;
    const BlockEdge& claimed = graph.edges[closures[closure(rng)]];
    corrupted.edges.push_back({i, j, e.T_from_to, claimed.kappa, claimed.tau});
  }
  return corrupted;
}

std::vector<BlockEdge> false_place(const std::vector<SE3>& poses, Eigen::Index a, Eigen::Index b,
                                   std::size_t size, const SE3& T_a_b, const Precision& claimed) {
  std::vector<BlockEdge> edges;
  for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(size); ++k) {
    const auto moved = [&](Eigen::Index first) {
      return poses[static_cast<std::size_t>(first)].inverse() *
             poses[static_cast<std::size_t>(first + k)];
    };
    edges.push_back(
        {a + k, b + k, moved(a).inverse() * T_a_b * moved(b), claimed.kappa, claimed.tau});
  }
  return edges;
}

TeamGraph corrupt_in_clusters(const TeamGraph& graph, const Clusters& clusters,
                              const std::vector<SE3>& poses, double half_side_m, unsigned seed) {
  TeamGraph corrupted = graph;
  if (clusters.places == 0) return corrupted;
  const std::vector<bool> odometry = odometry_edges(graph);
  const auto closure = std::find(odometry.begin(), odometry.end(), false);
  if (closure == odometry.end())
    throw std::invalid_argument("corrupt: the graph has no loop closure");
  const BlockEdge& claimed = graph.edges[static_cast<std::size_t>(closure - odometry.begin())];
  const auto length = static_cast<Eigen::Index>(clusters.size);
  std::mt19937 rng(seed);
  const auto any_place = [&](std::size_t robot) {
    if (graph.poses_of(robot) < length)
      throw std::invalid_argument("corrupt: robot " + std::to_string(robot) + " has " +
                                  std::to_string(graph.poses_of(robot)) + " poses");
    return std::uniform_int_distribution<Eigen::Index>(graph.first[robot],
                                                       graph.first[robot + 1] - length)(rng);
  };
  const RandomOutlierModel model{
      .keyframes = 3, .planar = graph.dimension == 2, .half_side_m = half_side_m};
  for (std::size_t n = 0; n < clusters.places; ++n) {
    const Eigen::Index a = any_place(0);
    const Eigen::Index b = any_place(graph.robots() - 1);
    const SE3 T_a_b = random_outliers(1, model, rng).front().T_from_to;
    for (const BlockEdge& e :
         false_place(poses, a, b, clusters.size, T_a_b, {claimed.kappa, claimed.tau}))
      corrupted.edges.push_back(e);
  }
  return corrupted;
}

OutlierStudy run_outlier_study(const TeamGraph& clean, const OutlierStudyOptions& options,
                               const TeamMeter& meter, const OutlierProgress& progress) {
  for (const double percent : options.shares_percent)
    if (!(percent >= 0.0 && std::isfinite(percent)))
      throw std::invalid_argument("outlier study: a share of " + std::to_string(percent) + " %");
  const CentralOptimum central = central_optimum(clean);
  const std::vector<SE3> truth = round_to_poses(central.X, central.X.leftCols<4>());
  const std::vector<bool> odometry = odometry_edges(clean);
  OutlierStudy study{
      .robots = clean.robots(),
      .poses = static_cast<std::size_t>(clean.poses()),
      .true_closures =
          static_cast<std::size_t>(std::count(odometry.begin(), odometry.end(), false)),
      .certified = central.certified,
      .half_side_m = options.half_side_m > 0.0 ? options.half_side_m : half_extent_m(truth),
      .results = {}};
  const std::size_t all =
      options.shares_percent.size() * options.methods.size() * options.seeds.size();
  for (const double percent : options.shares_percent)
    for (const std::string& method : options.methods)
      for (const unsigned seed : options.seeds) {
        if (progress) progress(study.results.size(), all);
        const auto count = static_cast<std::size_t>(
            std::lround(0.01 * percent * static_cast<double>(study.true_closures)));
        const TeamGraph corrupted =
            corrupt_in_clusters(corrupt(clean, count, study.half_side_m, seed), options.clusters,
                                truth, study.half_side_m, seed);
        OutlierResult result =
            attempt(method, corrupted, clean.edges.size(), truth, options, meter);
        result.share_percent = percent;
        result.seed = seed;
        result.false_closures = corrupted.edges.size() - clean.edges.size();
        study.results.push_back(std::move(result));
      }
  if (progress) progress(all, all);
  return study;
}

}  // namespace km
