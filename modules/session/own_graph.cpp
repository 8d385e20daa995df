#include "modules/session/own_graph.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "modules/core/config.hpp"
#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/io/bytes.hpp"

namespace km {
namespace {

constexpr std::size_t kKeptSets = 4;  // per peer: both robots agree on one of them

// Hash of the used measurements: direction, translation and weights, which the network preserves
// exactly. It excludes rotations, because as a quaternion a rotation loses its last bit.
EdgeSetId identify(std::uint32_t version, const std::vector<PoseEdge>& edges) {
  EdgeSetId id{version, kFnv1aBasis};
  mix_fnv1a(id.hash, version);
  for (const PoseEdge& e : edges) {
    for (const KeyframeId& end : {e.from, e.to})
      mix_fnv1a(id.hash, (std::uint64_t{end.robot} << 32U) | end.index);
    const Eigen::Vector3d& t = e.T_from_to.translation();
    for (const double x : {t.x(), t.y(), t.z(), e.precision.kappa, e.precision.tau})
      mix_fnv1a(id.hash, std::bit_cast<std::uint64_t>(x + 0.0));  // -0.0 equals 0.0
  }
  return id;
}

VerticalPrior vertical_prior(const KeyframeId& keyframe, const Vertical& vertical) {
  const double norm = vertical.up_body.norm();
  if (!(std::abs(norm - 1.0) <= kUnitTolerance) || !kTiltSigma_rad.contains(vertical.sigma_rad))
    throw std::invalid_argument("OwnGraph: the vertical of keyframe " + to_string(keyframe) +
                                " is not a direction with a usable sigma");
  return {Eigen::Index{keyframe.index}, vertical.up_body / norm,
          1.0 / (vertical.sigma_rad * vertical.sigma_rad)};
}

}  // namespace

bool OwnGraph::add(const KeyframeOdometry& keyframe) {
  if (keyframe.id.robot != self_ || keyframe.id.index != keyframes_) return false;
  std::optional<VerticalPrior> vertical;
  if (keyframe.vertical) vertical = vertical_prior(keyframe.id, *keyframe.vertical);
  if (keyframes_ > 0) {
    const auto step = pose_edge(
        {{self_, keyframes_ - 1}, keyframe.id, keyframe.T_previous_kf, keyframe.covariance});
    if (!step)
      throw std::invalid_argument("OwnGraph: odometry to keyframe " + to_string(keyframe.id) +
                                  " is not finite with a usable covariance");
    odometry_.push_back(*step);
    step_s_.push_back(seconds_between(newest_, keyframe.stamp));
    if (is_unknown_step(*step)) later_runs_.push_back(keyframe.id.index);
  } else {
    if (!keyframe.T_odom_kf.matrix().allFinite())
      throw std::invalid_argument("OwnGraph: the first keyframe's pose is not finite");
    T_odom_first_ = keyframe.T_odom_kf;
  }
  if (vertical) verticals_.push_back(*vertical);
  newest_ = keyframe.stamp;
  ++keyframes_;
  ++revision_;
  complete_sets();
  return true;
}

bool OwnGraph::add(const Closure& closure) {
  const ClosureId id = closure.id();
  if (!touches(id, self_) || id.from == id.to) return false;
  const auto edge = pose_edge(closure.relative_pose());
  if (!edge) return false;
  if (is_full(id)) return false;
  const RobotId peer = peer_of(id);
  const auto [known, is_new] = closures_.try_emplace(id, *edge);
  if (peer != self_ && (is_new || is_better(*edge, known->second))) {
    std::vector<AlignedOdometry>& of_peer = alignments_[peer];
    const auto at = std::ranges::lower_bound(of_peer, id, {}, &AlignedOdometry::closure);
    const AlignedOdometry aligned = align_odometry(closure);
    if (is_new)
      of_peer.insert(at, aligned);
    else
      *at = aligned;
  }
  if (is_new) {
    ++closures_to_[peer];
  } else {
    if (!is_better(*edge, known->second)) return false;
    known->second = *edge;
    const auto sets = sets_.find(peer);
    if (sets != sets_.end())
      sets->second.changed |= std::ranges::binary_search(sets->second.newest.closures, id);
  }
  complete_sets();
  return true;
}

std::span<const AlignedOdometry> OwnGraph::alignments(RobotId peer) const {
  const auto found = alignments_.find(peer);
  return found == alignments_.end() ? std::span<const AlignedOdometry>() : found->second;
}

bool OwnGraph::add(const PositionFix& fix) {
  const KeyframeIndex index = fix.keyframe.index;
  const bool is_next =
      fixes_.empty() || (fixes_.back().keyframe.index < index && fixes_.back().datum == fix.datum);
  const double variance = 3.0 * fix.sigma_m * fix.sigma_m;
  if (fix.keyframe.robot != self_ || index == 0 || index >= keyframes_ || !is_next ||
      fix.datum == 0 || !fix.p_datum.allFinite() || !fix.p_kf.allFinite() ||
      !kFix_m.contains(fix.p_datum.minCoeff()) || !kFix_m.contains(fix.p_datum.maxCoeff()) ||
      !kVariance.contains(variance))
    return false;
  fixes_.push_back(fix);
  ++revision_;
  return true;
}

RobotId OwnGraph::peer_of(const ClosureId& id) const {
  return id.from.robot == self_ ? id.to.robot : id.from.robot;
}

bool OwnGraph::is_full(const ClosureId& id) const {
  const RobotId peer = peer_of(id);
  const auto known = closures_to_.find(peer);
  return peer != self_ && known != closures_to_.end() && known->second >= kMaxClosures &&
         !closures_.contains(id);
}

bool OwnGraph::add(const InlierSet& set) {
  if (set.a > set.b || (set.a != self_ && set.b != self_)) return false;
  for (const ClosureId& id : set.closures)
    if (std::min(id.from.robot, id.to.robot) != set.a ||
        std::max(id.from.robot, id.to.robot) != set.b)
      return false;
  const auto [sets, is_first] = sets_.try_emplace(set.a == self_ ? set.b : set.a);
  InlierSet& newest = sets->second.newest;
  if (!is_first && set.version <= newest.version) return false;
  newest = set;
  for (ClosureId& id : newest.closures) id = closure_id(id.from, id.to);
  std::ranges::sort(newest.closures);
  // Not std::ranges::unique(): Clang 14 cannot compile its return type in libstdc++ 12.
  const auto repeated = std::unique(newest.closures.begin(), newest.closures.end());
  newest.closures.erase(repeated, newest.closures.end());
  sets->second.changed = true;
  complete_sets();
  return true;
}

void OwnGraph::forget(RobotId peer) {
  sets_.erase(peer);
  closures_to_.erase(peer);
  alignments_.erase(peer);
  std::erase_if(closures_, [&](const auto& closure) { return touches(closure.first, peer); });
}

void OwnGraph::complete_sets() {
  for (auto& [peer, sets] : sets_)
    if (sets.changed && complete(sets, peer == self_ ? 1 : kKeptSets)) {
      sets.changed = false;
      if (peer == self_) ++revision_;
    }
}

bool OwnGraph::complete(Sets& sets, std::size_t kept) const {
  const auto known = [&](const KeyframeId& end) {
    return end.robot != self_ || end.index < keyframes_;
  };
  EdgeSet result;
  for (const ClosureId& id : sets.newest.closures) {
    const auto found = closures_.find(id);
    if (found == closures_.end() || !known(id.from) || !known(id.to)) return false;
    result.edges.push_back(found->second);
  }
  result.id = identify(sets.newest.version, result.edges);
  if (sets.complete.size() == kept) sets.complete.pop_back();
  sets.complete.insert(sets.complete.begin(), std::move(result));
  return true;
}

std::vector<EdgeSetOffer> OwnGraph::offers() const {
  std::vector<EdgeSetOffer> offers;
  for (const auto& [peer, sets] : sets_)
    for (const EdgeSet& set : sets.complete)
      if (peer != self_ && !set.edges.empty())
        offers.push_back({peer, static_cast<std::uint32_t>(set.edges.size()), set.id});
  return offers;
}

const std::vector<PoseEdge>* OwnGraph::edges(RobotId peer, const EdgeSetId& id) const {
  const auto sets = sets_.find(peer);
  if (sets == sets_.end()) return nullptr;
  for (const EdgeSet& set : sets->second.complete)
    if (set.id == id) return &set.edges;
  return nullptr;
}

std::span<const PoseEdge> OwnGraph::newest_edges(RobotId peer) const {
  const auto sets = sets_.find(peer);
  if (sets == sets_.end() || sets->second.complete.empty()) return {};
  return sets->second.complete[0].edges;
}

void OwnGraph::judge_odometry(bool corrects) {
  odometry_judgement_ =
      km::judge_odometry(odometry_, newest_edges(self_), dimension_, step_s_, corrects);
}

std::vector<PoseEdge> OwnGraph::own_edges() const {
  std::vector<PoseEdge> edges = odometry_;
  odometry_judgement_.correct(edges);
  const OdometryNoise& noise = odometry_judgement_.noise;
  for (PoseEdge e : newest_edges(self_)) {
    e.precision = noise.corrected_closure(e.precision);
    edges.push_back(e);
  }
  return edges;
}

std::vector<PoseEdge> OwnGraph::closures_across(KeyframeIndex run, KeyframeIndex end) const {
  std::vector<PoseEdge> across;
  for (const PoseEdge& e : newest_edges(self_)) {
    const auto [first, second] = std::minmax(e.from.index, e.to.index);
    if (first < run && run <= second && second < end) across.push_back(e);
  }
  return across;
}

Precision OwnGraph::mean_step_precision() const {
  Precision sum{0.0, 0.0};  // sums of variances
  double steps = 0.0;
  for (const PoseEdge& step : odometry_) {
    if (is_unknown_step(step)) continue;
    sum.kappa += 1.0 / step.precision.kappa;
    sum.tau += 1.0 / step.precision.tau;
    ++steps;
  }
  if (steps == 0.0) return {};
  return odometry_noise().corrected({steps / sum.kappa, steps / sum.tau});
}

}  // namespace km
