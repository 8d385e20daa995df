#include "apps/outliers/outlier_study.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "apps/outliers/pairwise_consistency.hpp"
#include "apps/outliers/spoiled_graph.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/robust/staged_gnc_team.hpp"
#include "modules/pose_graph/rounding.hpp"
#include "modules/pose_graph/staircase.hpp"

namespace km {
namespace {

constexpr Eigen::Index kRank = 3;

TeamGraph part_with(const TeamGraph& graph, const std::vector<bool>& kept) {
  TeamGraph part = graph;
  part.edges.clear();
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (kept[k]) part.edges.push_back(graph.edges[k]);
  return part;
}

double rmse_m(const std::vector<SE3>& truth, const std::vector<SE3>& estimate) {
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < truth.size(); ++i)
    pairs.push_back({static_cast<Stamp>(i), truth[i], estimate[i]});
  const Alignment alignment = align(pairs, false);
  double sum = 0.0;
  for (const PosePair& pair : pairs)
    sum += (pair.T_truth_body.translation() - alignment.apply(pair.T_estimate_body).translation())
               .squaredNorm();
  return std::sqrt(sum / static_cast<double>(pairs.size()));
}

// Half the longest side of the box around all positions.
double half_extent_m(const std::vector<SE3>& poses) {
  Eigen::AlignedBox3d box;
  for (const SE3& T : poses) box.extend(T.translation());
  return 0.5 * box.sizes().maxCoeff();
}

struct Steps {
  int rounds = 0;
  bool ended = false;
};

Steps step_to_end(TeamSolver& team, int max_rounds, RoundMeter& meter) {
  Steps steps;
  while (steps.rounds < max_rounds && !steps.ended) {
    steps.ended = !team.step(meter);
    if (!steps.ended) ++steps.rounds;
  }
  return steps;
}

// One method on one spoiled graph.
class Attempt {
 public:
  Attempt(const SpoiledGraph& spoiled, const OutlierStudyOptions& options, const TeamMeter& meter)
      : spoiled_(spoiled),
        options_(options),
        meter_(meter),
        odometry_(odometry_edges(spoiled.graph)),
        kept_(spoiled.graph.edges.size(), true) {
    result_.noise_scale = closure_noise(spoiled.graph, odometry_, options.noise).scale;
    double& barc = options_.gnc.gnc.barc;
    barc = (barc > 0.0 ? barc : default_barc(spoiled.graph.dimension)) * result_.noise_scale;
  }

  OutlierResult run(Rejection method, const std::vector<SE3>& truth) {
    result_.method = method;
    if (method == Rejection::kPcm || method == Rejection::kPcmGnc) reject_inconsistent();
    const TeamGraph part = part_with(spoiled_.graph, kept_);
    RoundMeter meter(part.robots(), meter_);
    const bool gnc = method == Rejection::kGnc || method == Rejection::kPcmGnc;
    const std::vector<SE3> poses = gnc ? solve_robustly(part, meter) : solve(part, meter);
    const TeamWork work = meter.finish_round();
    result_.bytes = work.bytes;
    result_.cpu_s += work.total_cpu_s;
    result_.rmse_m = rmse_m(truth, poses);
    for (std::size_t k = 0; k < kept_.size(); ++k)
      if (kept_[k] && !odometry_[k])
        ++(spoiled_.is_false(k) ? result_.false_kept : result_.true_kept);
    return result_;
  }

 private:
  void reject_inconsistent() {
    const double begin_s = meter_.cpu_s();
    kept_ = pairwise_consistent(spoiled_.graph, options_.pcm, result_.noise_scale);
    result_.cpu_s += meter_.cpu_s() - begin_s;
  }

  // No residual is beyond this threshold. The agents of GNC take steps like those of `newton`, and
  // cope with false closures that are left: they keep lone ones out of the factorisation.
  std::vector<SE3> solve(const TeamGraph& part, RoundMeter& meter) {
    constexpr double kNothingBeyond = 1e6;
    GncTeam team(part, kRank, {}, {.gnc = {.barc = kNothingBeyond}});
    note(step_to_end(team, options_.max_rounds, meter));
    return round_to_poses(team_poses(part, team), lifted_identity(kRank));
  }

  std::vector<SE3> solve_robustly(const TeamGraph& part, RoundMeter& meter) {
    StagedGncTeam team(part, kRank, options_.gnc);
    note(step_to_end(team, options_.max_rounds, meter));
    const std::vector<bool> kept = team.kept();
    std::size_t next = 0;
    for (std::size_t k = 0; k < kept_.size(); ++k)
      if (kept_[k]) kept_[k] = kept[next++];
    return round_to_poses(team_poses(part, team), lifted_identity(kRank));
  }

  void note(const Steps& steps) {
    result_.rounds = steps.rounds;
    result_.decided = steps.ended;
  }

  const SpoiledGraph& spoiled_;
  OutlierStudyOptions options_;
  const TeamMeter& meter_;
  std::vector<bool> odometry_;
  std::vector<bool> kept_;
  OutlierResult result_;
};

}  // namespace

const char* to_string(Rejection method) {
  switch (method) {
    case Rejection::kNone:
      return "none";
    case Rejection::kPcm:
      return "pcm";
    case Rejection::kGnc:
      return "gnc";
    case Rejection::kPcmGnc:
      return "pcm+gnc";
  }
  return "?";
}

OutlierStudy run_outlier_study(const TeamGraph& clean, const OutlierStudyOptions& options,
                               const TeamMeter& meter, const OutlierProgress& progress) {
  for (const double percent : options.shares_percent)
    if (!(percent >= 0.0 && std::isfinite(percent)))
      throw std::invalid_argument("outlier study: a share of " + std::to_string(percent) + " %");
  Staircase staircase(clean.edges, lift(chordal_initialisation(clean.poses(), clean.edges), kRank));
  while (staircase.step()) {
  }
  const LiftedPoses& X = staircase.X();
  const std::vector<SE3> truth = round_to_poses(X, X.leftCols<4>());
  const std::vector<bool> odometry = odometry_edges(clean);
  OutlierStudy study{
      .robots = clean.robots(),
      .poses = static_cast<std::size_t>(clean.poses()),
      .true_closures =
          static_cast<std::size_t>(std::count(odometry.begin(), odometry.end(), false)),
      .certified = staircase.certificate() && staircase.certificate()->certified,
      .half_side_m = options.half_side_m > 0.0 ? options.half_side_m : half_extent_m(truth),
      .results = {}};
  const std::size_t all =
      options.shares_percent.size() * options.methods.size() * options.seeds.size();
  for (const double percent : options.shares_percent)
    for (const Rejection method : options.methods)
      for (const unsigned seed : options.seeds) {
        if (progress) progress(study.results.size(), all);
        const auto count = static_cast<std::size_t>(
            std::lround(0.01 * percent * static_cast<double>(study.true_closures)));
        const SpoiledGraph spoiled = spoil(clean, count, study.half_side_m, seed);
        OutlierResult result = Attempt(spoiled, options, meter).run(method, truth);
        result.share_percent = percent;
        result.seed = seed;
        result.false_closures = count;
        study.results.push_back(result);
      }
  if (progress) progress(all, all);
  return study;
}

}  // namespace km
