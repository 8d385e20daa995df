#include <algorithm>
#include <cmath>

#include "modules/robust/corroboration.hpp"
#include "modules/robust/tree_newton.hpp"

// The weights of the closures of a member: before the first step by their noise and the limits of
// pairs, then by graduated non-convexity.

namespace km {
namespace {

using Weighing = TreeVerdict::Weighing;

// kStrongest: largest strength of a pair while closures are weighed, relative to the usual pair, so
// that no pair overrules the others. At the end, kept closures have their own weight, except for
// pairs that the other edges contradict. The mean error of the closures of such a pair exceeds
// kPullOfMean standard deviations of this mean, and kPullOfOne standard deviations of a single
// closure.
constexpr double kStrongest = 1.25;
constexpr double kPullOfMean = 6.0;
constexpr double kPullOfOne = 1.0;
// Number of isolated closures of a pair up to which they do no harm and are weighed from the start.
constexpr std::ptrdiff_t kFewIsolated = 16;

}  // namespace

// The two robots of a pair know the same closures, poses and claimed precisions, so both compute
// the same noise. A pair with more noise than the team as a whole has less weight.
void TreeNewton::weigh_by_noise() {
  if (!options_.robust || noise_known_) return;
  noise_known_ = true;
  const std::vector<SE3> odometry = odometry_poses();
  for (const auto& [peer, indices] : by_peer()) {
    const Corroboration::PoseOf pose = pose_before_closures(peer, odometry);
    std::vector<PoseEdge> closures;
    for (const std::size_t k : indices)
      if (known_[k].trust == Trust::kOpen) closures.push_back(known_[k].edge);
    PairCycles& cycles = graph_.noise.pairs[peer];
    if (!graph_.again)  // the poses now fit the closures that the first look has kept
      Corroboration(closures, pose, graph_.step_precision, options_.dimension, graph_.later_runs)
          .count_cycles(cycles);
    cycles.factor = estimate_closure_noise(cycles, verdict_.noise_scale) / verdict_.noise_scale;
    weaken(indices, cycles.factor);
  }
}

// A pair whose cycles do not show how noisy its closures are is assumed to have the noise of the
// usual pair.
void TreeNewton::weigh_by_usual_noise() {
  if (!(verdict_.usual_noise > 1.0)) return;
  for (const auto& [peer, indices] : by_peer()) {
    PairCycles& cycles = graph_.noise.pairs[peer];
    if (!(cycles.factor < verdict_.usual_noise)) continue;
    const double usual = verdict_.usual_noise * verdict_.noise_scale;
    if (excludes_noise(cycles, usual, cycles.factor * verdict_.noise_scale)) continue;
    weaken(indices, verdict_.usual_noise / cycles.factor);
    cycles.factor = verdict_.usual_noise;
  }
}

void TreeNewton::weaken(std::span<const std::size_t> closures, double factor) {
  for (const std::size_t k : closures) {
    known_[k].edge.precision.kappa /= factor * factor;
    known_[k].edge.precision.tau /= factor * factor;
  }
}

void TreeNewton::find_isolated(double barc) {
  const Corroboration::PoseOf pose = [this](const KeyframeId& id) { return start_of(id); };
  for (const auto& [peer, indices] : by_peer()) {
    std::vector<PoseEdge> closures;
    std::vector<std::size_t> open;
    for (const std::size_t k : indices)
      if (known_[k].trust != Trust::kRejected) {
        closures.push_back(known_[k].edge);
        open.push_back(k);
      }
    const auto isolated =
        Corroboration(closures, pose, graph_.step_precision, options_.dimension, graph_.later_runs)
            .isolated(barc);
    const auto alone = std::ranges::count(isolated, true);
    for (std::size_t k = 0; k < open.size() && alone > kFewIsolated; ++k) {
      Known& known = known_[open[k]];
      const bool fits =
          residual_of(known.edge, pose(known.edge.from), pose(known.edge.to)) <= verdict_.barc;
      const bool kept_alone = known.settled && known.weight > 0.5;
      known.deferred = isolated[k] && known.trust == Trust::kOpen && !kept_alone && !fits;
    }
  }
}

// All closures of a limited pair have the same factor.
std::map<RobotId, double> TreeNewton::limits_of_pairs() const {
  std::map<RobotId, Precision> sums;
  for (std::size_t k = inside_; k < known_.size(); ++k) {
    if (!takes_part(known_[k])) continue;
    Precision& sum = sums.try_emplace(peer_of(known_[k]), Precision{0.0, 0.0}).first->second;
    sum.kappa += known_[k].edge.precision.kappa;
    sum.tau += known_[k].edge.precision.tau;
  }
  std::map<RobotId, double> limits;
  for (const auto& [robot, sum] : sums)
    limits[robot] = std::min(1.0, kStrongest * std::min(verdict_.usual_pair.kappa / sum.kappa,
                                                        verdict_.usual_pair.tau / sum.tau));
  return limits;
}

// Computes the weights of the closures at the present poses. The root may still reject these poses.
// Decided weights do not change; a weight that would be decided differently at the present poses
// counts as changed.
void TreeNewton::weigh_candidates(TreeSums& sums) {
  const double c2 = verdict_.barc * verdict_.barc;
  const bool decided = verdict_.weighing == Weighing::kDecided;
  for (const std::size_t k : front_edge_) {
    Known& known = known_[k];
    known.candidate = known.weight;
    if (known.trust != Trust::kOpen) {
      sums.kept += known.odometry ? 0 : 1;
      continue;
    }
    const double r = residual_of(known.edge, pose_at(known.edge.from, present_),
                                 pose_at(known.edge.to, present_));
    const double weight = robust_weight(r * r, c2, decided ? kLargestMu : verdict_.mu);
    const bool weighs = verdict_.weighing == Weighing::kWeigh;
    if (weighs && known.contradicted) known.settled = false;
    known.contradicted = known.settled && decided && weight != known.weight;
    if (known.settled) {
      sums.kept += known.weight > 0.5 ? 1 : 0;
      sums.changed += known.contradicted ? 1 : 0;
      continue;
    }
    if (weighs) known.candidate = weight;
    ++sums.open;
    sums.largest = std::max(sums.largest, static_cast<float>(r));
    if ((decided ? weight : known.candidate) != known.weight) ++sums.changed;
    if (known.candidate != 0.0 && known.candidate != 1.0) ++sums.fractional;
    sums.kept += known.candidate > 0.5 ? 1 : 0;
    sums.rejected += k >= inside_ && known.candidate <= 0.5 ? 1 : 0;
  }
  limit_candidates(decided);
}

// Once all weights are decided, the limit of a pair ends in the first round in which its closures
// no longer all pull in one direction. In earlier rounds even consistent pairs show such a pull,
// because the poses have not converged.
void TreeNewton::limit_candidates(bool decided) {
  const std::set<RobotId> contradicted = decided ? contradicted_pairs() : std::set<RobotId>{};
  for (const std::size_t k : front_edge_) {
    Known& known = known_[k];
    const bool free = known.pair_factor == 1.0 || !contradicted.contains(peer_of(known));
    known.candidate_pair_factor = decided && free ? 1.0 : known.pair_limit;
  }
}

// The limited pairs whose closures all pull in one direction at the present poses, with a mean that
// noise does not explain.
std::set<RobotId> TreeNewton::contradicted_pairs() const {
  struct Pull {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0.0;
    double closures = 0.0;  // sum of the weights of the closures
  };
  std::map<RobotId, Pull> pulls;
  for (const std::size_t k : front_edge_) {
    const Known& known = known_[k];
    const PoseEdge& edge = known.edge;
    if (known.pair_limit == 1.0) continue;
    const SE3& T_from = pose_at(edge.from, present_);
    const Eigen::Vector3d off =
        pose_at(edge.to, present_).translation() - T_from * edge.T_from_to.translation();
    Pull& pull = pulls[peer_of(known)];
    const double counts = known.candidate * known.pair_limit;
    const double weight = counts * edge.precision.tau;
    pull.sum += (edge.from.robot == graph_.self ? weight : -weight) * off;
    pull.weight += weight;
    pull.closures += counts;
  }
  std::set<RobotId> contradicted;
  for (const auto& [robot, pull] : pulls) {
    const double most = std::max(kPullOfMean, kPullOfOne * std::sqrt(pull.closures));
    if (pull.sum.norm() > most * verdict_.noise_scale * std::sqrt(pull.weight))
      contradicted.insert(robot);
  }
  return contradicted;
}

}  // namespace km
