#include "modules/robust/member_edges.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "modules/robust/odometry_evidence.hpp"
#include "modules/tree_newton/closure_cover.hpp"

namespace km {
namespace {

using Next = TreeVerdict::Next;

// Maximum number of cycles per robot pair in the noise estimate. With four or more robots it is
// smaller, so that one robot cannot dominate the estimate.
constexpr std::size_t kEnoughLengths = 300;
constexpr std::size_t kShareOfLengths = 60;
// Largest strength of a pair while closures are weighed, relative to the usual pair, so that no
// pair overrules the others. At the end, kept closures have their own weight, except for pairs that
// the other edges contradict, see TreeRoot.
constexpr double kStrongest = 1.25;
// Number of isolated closures of a pair up to which they do no harm and are weighed from the start.
constexpr std::ptrdiff_t kFewIsolated = 16;

// Largest residual of a closure that a second look weighs, relative to the largest one of an
// inlier. It exceeds 1 because the solution was computed without these closures.
constexpr double kSecondLook = 5.0;

void divide(Precision& precision, double factor) {
  precision.kappa /= factor;
  precision.tau /= factor;
}

bool is_rejected(const SessionGraph& graph, const PoseEdge& edge) {
  const auto decided = graph.decided.find(edge.id());
  return decided != graph.decided.end() && !decided->second;
}

}  // namespace

MemberEdges::MemberEdges(SessionGraph graph, TreePlace place, const TreeNewtonOptions& options)
    : graph_(std::move(graph)),
      place_(std::move(place)),
      options_(options),
      inside_(graph_.own.size()),
      lengths_due_(options.robust) {
  known_.reserve(inside_ + graph_.between.size());
  for (const PoseEdge& e : std::exchange(graph_.own, {}))
    known_.push_back({.edge = e, .odometry = known_.size() < graph_.odometry});
  for (const PoseEdge& e : graph_.between) {
    (void)start_of(e.from);
    (void)start_of(e.to);
    const auto [least, common] = closure_precisions(e.peer_of(graph_.self));
    Known& known = known_.emplace_back(e);
    known.edge.precision.kappa *= common.kappa;
    known.edge.precision.tau *= common.tau;
  }
  weaken_odometry();  // in a second look
  reopen();
  classify();
}

const SE3& MemberEdges::start_of(const KeyframeId& id) const {
  if (id.robot == graph_.self && id.index < graph_.start.size()) return graph_.start[id.index];
  const auto found = graph_.public_poses.find(id);
  if (found == graph_.public_poses.end())
    throw std::invalid_argument("TreeNewton: no robot has published pose " + to_string(id));
  return found->second;
}

// The smaller and the larger weights that this robot and `peer` report for the closures inside
// them. Closures between the robots have the larger ones, unless cycles show more noise.
std::pair<Precision, Precision> MemberEdges::closure_precisions(RobotId peer) {
  const Precision own = graph_.closure_precision[graph_.self];
  const Precision other = graph_.closure_precision[peer];
  return {{std::min(own.kappa, other.kappa), std::min(own.tau, other.tau)},
          {std::max(own.kappa, other.kappa), std::max(own.tau, other.tau)}};
}

// Both robots of a pair use the poses and verdicts that are sent, and so decide equally.
void MemberEdges::reopen() {
  if (!(graph_.first_barc > 0.0)) return;
  const Corroboration::PoseOf pose = [this](const KeyframeId& id) { return start_of(id); };
  for (const auto& [peer, indices] : by_peer()) {
    const std::vector<PoseEdge> closures = select(indices, [](const Known&) { return true; });
    std::vector<bool> kept;
    for (const PoseEdge& e : closures) kept.push_back(!is_rejected(graph_, e));
    const std::vector<bool> possible = corroboration(closures, pose).possible(kept);
    for (std::size_t k = 0; k < closures.size(); ++k) {
      const PoseEdge& e = closures[k];
      if (!kept[k] && (possible[k] ||
                       residual_of(e, pose(e.from), pose(e.to)) <= kSecondLook * graph_.first_barc))
        graph_.decided.erase(e.id());
    }
  }
}

std::uint32_t MemberEdges::count_possible(const EdgeWeights& weights, const FrontEdges& front,
                                          std::span<const SE3> present, double barc) const {
  struct OfPeer {
    std::vector<PoseEdge> closures;
    std::vector<bool> kept, far;
  };
  std::map<RobotId, OfPeer> pairs;
  std::map<KeyframeId, SE3> poses;
  std::size_t weighed = 0;
  for (const Known& k : known_) {
    if (!takes_part(k) || !k.own) continue;
    const std::size_t edge = weighed++;
    if (k.odometry) continue;
    const EdgeSlot& slot = front.slots()[edge];
    poses[k.edge.from] = present[static_cast<std::size_t>(slot.i)];
    poses[k.edge.to] = present[static_cast<std::size_t>(slot.j)];
    OfPeer& pair = pairs[k.edge.peer_of(graph_.self)];
    pair.closures.push_back(k.edge);
    pair.kept.push_back(weights.keeps(edge));
    pair.far.push_back(residual_of(k.edge, poses[k.edge.from], poses[k.edge.to]) >
                       kSecondLook * barc);
  }
  const Corroboration::PoseOf pose = [&poses](const KeyframeId& id) { return poses.at(id); };
  std::uint32_t count = 0;
  for (const auto& [peer, pair] : pairs) {
    const std::vector<bool> possible = corroboration(pair.closures, pose).possible(pair.kept);
    for (std::size_t k = 0; k < possible.size(); ++k) count += possible[k] && pair.far[k] ? 1 : 0;
  }
  return count;
}

void MemberEdges::classify() {
  if (!options_.robust) return;
  for (const auto& [peer, closures] : by_peer()) {
    const bool any_new = std::ranges::any_of(
        closures, [&](std::size_t k) { return !graph_.decided.contains(known_[k].edge.id()); });
    for (const std::size_t k : closures)
      if (is_rejected(graph_, known_[k].edge))
        known_[k].trust = Trust::kRejected;
      else if (any_new)
        known_[k].trust = Trust::kOpen;
  }
}

// Indices in known_ of closures, by the other robot of the pair; closures inside this robot by its
// own id.
std::map<RobotId, MemberEdges::Indices> MemberEdges::by_peer() const {
  std::map<RobotId, Indices> closures;
  for (std::size_t k = graph_.odometry; k < known_.size(); ++k)
    closures[known_[k].edge.peer_of(graph_.self)].push_back(k);
  return closures;
}

std::vector<PoseEdge> MemberEdges::select(const Indices& closures, auto&& condition) const {
  std::vector<PoseEdge> selected;
  for (const std::size_t k : closures)
    if (condition(known_[k])) selected.push_back(known_[k].edge);
  return selected;
}

// True if this robot reports the closure: of both robots that know it, only the one with the lower
// id does.
bool MemberEdges::reports(const Known& k) const {
  return graph_.self <= std::min(k.edge.from.robot, k.edge.to.robot);
}

Corroboration MemberEdges::corroboration(std::span<const PoseEdge> closures,
                                         const Corroboration::PoseOf& pose) const {
  return {closures, pose, graph_.step_precision, options_.dimension, graph_.later_runs};
}

// Calls visit(peer, indices, open), where `open` are the open closures of a pair at their poses for
// cycles. Poses that were optimised with closures hide errors of cycles, so closures inside this
// robot are compared with its odometry; unknown steps are those of the start. For closures to
// another robot, both robots use the starts of public poses, because they know nothing else of each
// other.
void MemberEdges::for_cycles(auto&& visit) {
  std::vector<SE3> odometry{graph_.start.front()};
  for (std::size_t k = 0; k < graph_.odometry; ++k) {
    const PoseEdge& step = known_[k].edge;
    odometry.push_back(odometry.back() * (is_unknown_step(step)
                                              ? graph_.start[k].inverse() * graph_.start[k + 1]
                                              : step.T_from_to));
  }
  for (const auto& [peer, indices] : by_peer()) {
    const Corroboration::PoseOf pose = [&, inside = peer == graph_.self](const KeyframeId& id) {
      return inside ? odometry.at(id.index) : start_of(id);
    };
    const std::vector<PoseEdge> open =
        select(indices, [](const Known& k) { return k.trust == Trust::kOpen; });
    visit(peer, indices, corroboration(open, pose));
  }
}

TreeSums MemberEdges::count() {
  const bool first = !std::exchange(counted_, true);
  TreeSums sums{.fixed = static_cast<std::uint32_t>(graph_.to_absent.size()),
                .poses = static_cast<std::uint32_t>(graph_.start.size())};
  for (const Known& k : known_) {
    if (!reports(k)) continue;
    if (k.deferred) ++sums.left;
    if (k.trust != Trust::kOpen) continue;
    const auto r =
        static_cast<float>(residual_of(k.edge, start_of(k.edge.from), start_of(k.edge.to)));
    sums.largest_of_all = std::max(sums.largest_of_all, r);
    if (k.deferred || k.settled) continue;
    ++sums.open;
    sums.largest = std::max(sums.largest, r);
  }
  auto of_peer = by_peer();
  for (const PoseEdge& tie : graph_.datum_ties) (void)of_peer[tie.to.robot];
  for (const auto& [peer, closures] : of_peer) {
    if (peer <= graph_.self) continue;
    if (PairVote vote = vote_on(peer, closures, first); vote.used > 0)
      sums.votes.push_back(std::move(vote));
  }
  if (!std::exchange(lengths_due_, false)) return sums;
  const std::size_t most =
      place_.members.size() < kEnoughToOutvote ? kEnoughLengths : kShareOfLengths;
  if (!graph_.again)
    for_cycles([&](RobotId peer, const Indices&, const Corroboration& open) {
      if (graph_.self <= peer) open.count_lengths(graph_.noise.lengths, most);
    });
  sums.lengths = graph_.noise.lengths;
  return sums;
}

PairVote MemberEdges::vote_on(RobotId peer, const Indices& indices, bool first) const {
  const Corroboration::PoseOf pose = [this](const KeyframeId& id) { return start_of(id); };
  const std::vector<PoseEdge> closures = select(indices, takes_part);
  PairVote vote{graph_.self, peer, static_cast<std::uint32_t>(closures.size())};
  if (const auto motion = motion_of_pair(closures, graph_.self, pose)) vote.motion = *motion;
  const auto tie = std::ranges::find_if(graph_.datum_ties,
                                        [&](const PoseEdge& e) { return e.to.robot == peer; });
  if (tie != graph_.datum_ties.end()) {
    ++vote.used;
    vote.motion = tied(vote.motion, *tie, pose);
  }
  const auto has_runs = [this](RobotId robot) {  // their unknown steps are no noise
    const auto runs = graph_.later_runs.find(robot);
    return runs != graph_.later_runs.end() && !runs->second.empty();
  };
  if (options_.robust && first && !graph_.again && !has_runs(graph_.self) && !has_runs(peer))
    vote.odometry = odometry_evidence(closures, pose, graph_.step_precision, options_.dimension);
  const auto cycles = graph_.noise.pairs.find(peer);
  if (noise_known_ && cycles != graph_.noise.pairs.end() && shows_noise(cycles->second))
    vote.noise = static_cast<float>(cycles->second.factor);
  return vote;
}

void MemberEdges::follow(const TreeVerdict& verdict) {
  if (verdict.weigh_all)
    for (Known& k : known_) k.settled = false;
  if (!verdict.odometry.empty()) {  // the closures are counted again, nothing else
    graph_.noise.odometry = verdict.odometry;
    graph_.noise.lengths.clear();
    lengths_due_ = options_.robust;
    return weaken_odometry();
  }
  weigh_by_noise(verdict.noise_scale);
  move_robots(verdict.moves);
  if (verdict.next == Next::kCount) {
    settle(verdict.barc);
    if (verdict.deferred) find_isolated(verdict);
  } else if (verdict.next == Next::kStart) {
    weigh_by_usual_noise(verdict.usual_noise, verdict.noise_scale);
    if (!verdict.deferred)
      for (Known& k : known_) k.deferred = false;
  }
}

// All members know the mean steps of all, so all weaken them equally.
void MemberEdges::weaken_odometry() {
  for (const auto& [robot, factor] : graph_.noise.odometry) {
    if (const auto step = graph_.step_precision.find(robot); step != graph_.step_precision.end())
      divide(step->second, factor * factor);
    if (robot != graph_.self) continue;
    odometry_noise_ = factor;
    for (std::size_t k = 0; k < graph_.odometry; ++k)
      divide(known_[k].edge.precision, factor * factor);
  }
}

// A pair with more noise than the team as a whole has less weight.
void MemberEdges::weigh_by_noise(double noise_scale) {
  if (!options_.robust || std::exchange(noise_known_, true)) return;
  for_cycles([&](RobotId peer, const Indices& indices, const Corroboration& open) {
    PairCycles& cycles = graph_.noise.pairs[peer];
    if (!graph_.again)  // the poses now fit the closures that the first look has kept
      open.count_cycles(cycles);
    cycles.factor = estimate_closure_noise(cycles, noise_scale) / noise_scale;
    const auto [least, common] = closure_precisions(peer);
    const double noise = std::sqrt(std::min(common.kappa / least.kappa, common.tau / least.tau));
    if (cycles.factor < noise && shows_factor(cycles, noise_scale, noise * noise_scale))
      cycles.factor = noise;
    for (const std::size_t k : indices)
      divide(known_[k].edge.precision, cycles.factor * cycles.factor);
  });
}

// A pair whose cycles do not show how noisy its closures are is assumed to have the noise of the
// usual pair.
void MemberEdges::weigh_by_usual_noise(double usual, double noise_scale) {
  if (!(usual > 1.0)) return;
  for (const auto& [peer, closures] : by_peer()) {
    PairCycles& cycles = graph_.noise.pairs[peer];
    if (!(cycles.factor < usual) ||
        excludes_noise(cycles, usual * noise_scale, cycles.factor * noise_scale))
      continue;
    const double factor = usual / cycles.factor;
    for (const std::size_t k : closures) divide(known_[k].edge.precision, factor * factor);
    cycles.factor = usual;
  }
}

// Public poses are sent in single precision. After the motion they are rounded again, so that all
// robots have equal values.
void MemberEdges::move_robots(const std::vector<std::pair<RobotId, SinglePose>>& moves) {
  std::set<KeyframeIndex> ends{0};
  for (const PoseEdge& e : graph_.between) ends.insert(e.end_on(graph_.self).index);
  for (const auto& [robot, move] : moves) {
    const SE3 T = move.pose();
    for (auto& [id, pose] : graph_.public_poses)
      if (id.robot == robot) pose = SinglePose::of(T * pose).pose();
    if (robot != graph_.self) continue;
    for (SE3& pose : graph_.start) pose = T * pose;
    for (const KeyframeIndex k : ends) graph_.start[k] = SinglePose::of(graph_.start[k]).pose();
  }
}

// Decides the closures inside this robot by its start, see relaxed_start(). Their weights then do
// not change from round to round, nor do the second derivatives that this robot sends.
void MemberEdges::settle(double barc) {
  if (place_.members.size() < 2) return;
  const std::span<Known> inside = std::span(known_).first(inside_).subspan(graph_.odometry);
  std::vector<PoseEdge> open;
  for (const Known& k : inside)
    if (k.trust == Trust::kOpen) open.push_back(k.edge);
  if (!mostly_fit(open, graph_.start, barc)) return;
  for (Known& k : inside) {
    k.settled = k.trust == Trust::kOpen;
    k.fits = residual_of(k.edge, start_of(k.edge.from), start_of(k.edge.to)) <= barc;
  }
}

void MemberEdges::find_isolated(const TreeVerdict& verdict) {
  const double barc = default_threshold(options_.dimension) * verdict.noise_scale;
  const Corroboration::PoseOf pose = [this](const KeyframeId& id) { return start_of(id); };
  for (auto& [peer, indices] : by_peer()) {
    std::erase_if(indices, [&](std::size_t k) { return known_[k].trust == Trust::kRejected; });
    const std::vector<PoseEdge> closures = select(indices, [](const Known&) { return true; });
    const std::vector<bool> isolated = corroboration(closures, pose).isolated(barc);
    if (std::ranges::count(isolated, true) <= kFewIsolated) continue;
    for (std::size_t k = 0; k < indices.size(); ++k) {
      Known& known = known_[indices[k]];
      const bool fits =
          residual_of(known.edge, pose(known.edge.from), pose(known.edge.to)) <= verdict.barc;
      known.deferred =
          isolated[k] && known.trust == Trust::kOpen && !(known.settled && known.fits) && !fits;
    }
  }
}

// The higher robot of a datum tie has it among its own edges.
void MemberEdges::share_closures(std::map<KeyframeIndex, std::uint32_t>& touched_by) {
  std::map<RobotId, std::set<KeyframeIndex>> touched_from;
  for (const PoseEdge& tie : graph_.datum_ties)
    if (tie.from.robot == graph_.self) touched_from[tie.to.robot].insert(tie.from.index);
  for (auto& [peer, indices] : by_peer()) {
    if (peer == graph_.self) continue;
    std::erase_if(indices, [&](std::size_t k) { return !takes_part(known_[k]); });
    std::vector<ClosureId> ids;
    for (const std::size_t k : indices) ids.push_back(known_[k].edge.id());
    const bool is_child = std::ranges::binary_search(place_.children, peer);
    const std::vector<bool> own =
        weighed_closures(ids, graph_.self, peer,
                         is_child                ? std::optional(peer)
                         : place_.parent == peer ? std::optional(graph_.self)
                                                 : std::nullopt);
    for (std::size_t k = 0; k < indices.size(); ++k) {
      Known& known = known_[indices[k]];
      known.own = own[k];
      if (!known.own) touched_from[peer].insert(known.edge.end_on(graph_.self).index);
    }
  }
  for (const auto& [peer, theirs] : touched_from)
    for (const KeyframeIndex index : theirs) ++touched_by.try_emplace(index, 1).first->second;
}

FrontGraph MemberEdges::front_graph(bool free) {
  FrontGraph front{.self = graph_.self,
                   .poses = std::ssize(graph_.start),
                   .dimension = options_.dimension,
                   .verticals = graph_.verticals,
                   .root = !place_.parent.has_value(),
                   .free = free};
  if (options_.covariances) front.origin = graph_.origin;
  share_closures(front.touched_by);
  for (const Known& k : known_)
    if (takes_part(k) && k.own) front.edges.push_back(k.edge);
  front.edges.insert(front.edges.end(), graph_.fixes.begin(), graph_.fixes.end());
  for (const PoseEdge& tie : graph_.datum_ties) {
    front.open.insert(tie.end_on(graph_.self).index);
    if (tie.to.robot == graph_.self) front.edges.push_back(tie);
  }
  for (const PoseEdge& e : graph_.to_absent) {
    front.edges.push_back(e);
    front.held[e.other(graph_.self)] = start_of(e.other(graph_.self));
  }
  for (const PoseEdge& e : graph_.between) front.open.insert(e.end_on(graph_.self).index);
  return front;
}

// All closures of a limited pair have the same factor.
EdgeWeights MemberEdges::weights(const Precision& usual_pair) const {
  std::map<RobotId, Precision> sums;
  for (std::size_t k = inside_; k < known_.size(); ++k) {
    const PoseEdge& edge = known_[k].edge;
    if (!takes_part(known_[k])) continue;
    Precision& sum =
        sums.try_emplace(edge.other(graph_.self).robot, Precision{0.0, 0.0}).first->second;
    sum.kappa += edge.precision.kappa;
    sum.tau += edge.precision.tau;
  }
  std::map<RobotId, ClosureVolume> volumes;
  for (const auto& [peer, closures] : by_peer())
    for (const std::size_t k : closures) {
      const PoseEdge& e = known_[k].edge;
      volumes[peer].add_ends(start_of(e.id().from).translation(),
                             start_of(e.id().to).translation());
      volumes[peer].add_length(e.T_from_to.translation().norm());
    }
  std::vector<EdgeWeight> weights;
  for (const Known& k : known_) {
    if (!takes_part(k) || !k.own) continue;
    EdgeWeight& weight = weights.emplace_back();
    weight = {.peer = k.edge.peer_of(graph_.self),
              .is_between = k.edge.from.robot != k.edge.to.robot,
              .is_odometry = k.odometry,
              .is_open = k.trust == Trust::kOpen,
              .is_settled = k.settled};
    if (!k.odometry) weight.volume = volumes.at(weight.peer).of(options_.dimension);
    weight.weight = weight.candidate = k.settled && !k.fits ? 0.0 : 1.0;
    if (!weight.is_between) continue;
    const Precision& sum = sums.at(weight.peer);
    weight.pair_limit = std::min(
        1.0, kStrongest * std::min(usual_pair.kappa / sum.kappa, usual_pair.tau / sum.tau));
  }
  const auto left_out = std::ranges::count_if(
      known_, [&](const Known& k) { return !k.odometry && !takes_part(k) && reports(k); });
  return EdgeWeights(std::move(weights), static_cast<std::uint32_t>(left_out));
}

ClosureVerdicts MemberEdges::verdicts(const EdgeWeights& weights) const {
  ClosureVerdicts verdicts;
  std::size_t weighed = 0;
  for (const Known& k : known_) {
    const bool has_weight = takes_part(k) && k.own;
    const bool kept = has_weight && weights.keeps(weighed++);
    if (!k.odometry && (takes_part(k) ? k.own : reports(k)))
      verdicts.closures.push_back({k.edge.id(), kept});
  }
  return verdicts;
}

}  // namespace km
