#include "modules/pose_graph/local_graph.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "modules/core/config.hpp"
#include "modules/core/precision.hpp"

namespace km {
namespace {

constexpr std::size_t kKeptVersions = 4;

void mix(std::uint64_t& hash, std::uint64_t value) {  // FNV-1a, bytewise
  for (int byte = 0; byte < 8; ++byte) {
    hash ^= (value >> (8 * byte)) & 0xffU;
    hash *= 0x100000001b3ULL;
  }
}

EdgeSetId identify(const InlierSet& set) {
  EdgeSetId id{set.version, 0xcbf29ce484222325ULL};
  mix(id.hash, set.version);
  for (const ClosureId& closure : set.closures)
    for (const KeyframeId& end : {closure.from, closure.to})
      mix(id.hash, (std::uint64_t{end.robot} << 32U) | end.index);
  return id;
}

// nullopt for measurements that would spoil the numbers of everyone: weights are bounded.
std::optional<BlockEdge> block_edge(const RelativePose& measured) {
  const double rotation = measured.covariance.topLeftCorner<3, 3>().trace();
  const double translation = measured.covariance.bottomRightCorner<3, 3>().trace();
  constexpr Bounds<double> kVariance{1e-12, 1e12};
  if (!measured.T_from_to.matrix().allFinite() || !kVariance.contains(rotation) ||
      !kVariance.contains(translation))
    return std::nullopt;
  const Precision weight = precision_of(measured.covariance);
  return BlockEdge{measured.from.index, measured.to.index, measured.T_from_to, weight.kappa,
                   weight.tau};
}

VerticalPrior vertical_prior(const KeyframeId& keyframe, const Vertical& vertical) {
  constexpr Bounds<double> kSigma{1e-4, 1.6};
  constexpr double kUnit = 1e-3;
  const double norm = vertical.up_body.norm();
  if (!(std::abs(norm - 1.0) < kUnit) || !kSigma.contains(vertical.sigma_rad))
    throw std::invalid_argument("LocalGraph: the vertical of keyframe " + to_string(keyframe) +
                                " is not a direction with a usable sigma");
  return {Eigen::Index{keyframe.index}, vertical.up_body / norm,
          1.0 / (vertical.sigma_rad * vertical.sigma_rad)};
}

}  // namespace

ClosureId closure_id(RobotId self, const BlockEdge& edge) {
  return {{self, static_cast<KeyframeIndex>(edge.i)}, {self, static_cast<KeyframeIndex>(edge.j)}};
}

ClosureId closure_id(RobotId self, RobotId peer, const InterEdge& edge) {
  const KeyframeId own{self, edge.own};
  const KeyframeId other{peer, edge.other};
  return edge.from_own ? ClosureId{own, other} : ClosureId{other, own};
}

bool LocalGraph::add(const KeyframeOdometry& keyframe) {
  if (keyframe.id.robot != self_ || keyframe.id.index != keyframes_) return false;
  std::optional<VerticalPrior> vertical;
  if (keyframe.vertical) vertical = vertical_prior(keyframe.id, *keyframe.vertical);
  if (keyframes_ > 0) {
    const auto step = block_edge(
        {{self_, keyframes_ - 1}, keyframe.id, keyframe.T_previous_kf, keyframe.covariance});
    if (!step)
      throw std::invalid_argument("LocalGraph: odometry to keyframe " + to_string(keyframe.id) +
                                  " is not finite with a usable covariance");
    odometry_.push_back(*step);
  } else {
    if (!keyframe.T_odom_kf.matrix().allFinite())
      throw std::invalid_argument("LocalGraph: the first keyframe's pose is not finite");
    T_odom_first_ = keyframe.T_odom_kf;
  }
  if (vertical) verticals_.push_back(*vertical);
  ++keyframes_;
  ++revision_;
  complete_sets();
  return true;
}

bool LocalGraph::add(const Closure& closure) {
  const ClosureId id = closure.id();
  const bool touches = id.from.robot == self_ || id.to.robot == self_;
  if (!touches || id.from == id.to || closures_.contains(id)) return false;
  const auto edge = block_edge(closure.relative_pose());
  if (!edge) return false;
  closures_.emplace(id, *edge);
  complete_sets();
  return true;
}

bool LocalGraph::add(const InlierSet& set) {
  if (set.a > set.b || (set.a != self_ && set.b != self_)) return false;
  for (const ClosureId& id : set.closures)
    if (std::min(id.from.robot, id.to.robot) != set.a ||
        std::max(id.from.robot, id.to.robot) != set.b)
      return false;
  const RobotId peer = set.a == self_ ? set.b : set.a;
  const auto newest = newest_version_.find(peer);
  if (newest != newest_version_.end() && set.version <= newest->second) return false;
  newest_version_[peer] = set.version;
  InlierSet& pending = pending_[peer] = set;
  std::sort(pending.closures.begin(), pending.closures.end());
  const auto repeated = std::unique(pending.closures.begin(), pending.closures.end());
  pending.closures.erase(repeated, pending.closures.end());
  complete_sets();
  return true;
}

void LocalGraph::forget(RobotId peer) {
  pending_.erase(peer);
  newest_version_.erase(peer);
  sets_.erase(peer);
  std::erase_if(closures_, [&](const auto& closure) {
    return closure.first.from.robot == peer || closure.first.to.robot == peer;
  });
}

void LocalGraph::complete_sets() {
  std::erase_if(pending_, [&](const auto& peer_and_set) { return complete(peer_and_set.second); });
}

bool LocalGraph::complete(const InlierSet& set) {
  EdgeSet result{identify(set), {}};
  std::vector<BlockEdge> intra;
  const auto known = [&](const KeyframeId& end) {
    return end.robot != self_ || end.index < keyframes_;
  };
  for (const ClosureId& id : set.closures) {
    const auto found = closures_.find(id);
    if (found == closures_.end() || !known(id.from) || !known(id.to)) return false;
    const BlockEdge& e = found->second;
    const bool from_own = id.from.robot == self_;
    if (set.a == set.b)
      intra.push_back(e);
    else
      result.edges.push_back({from_own ? id.from.index : id.to.index,
                              from_own ? id.to.index : id.from.index, from_own, e.T_i_j, e.kappa,
                              e.tau});
  }
  if (set.a == set.b) {
    intra_ = std::move(intra);
    ++revision_;
    return true;
  }
  std::vector<EdgeSet>& sets = sets_[set.a == self_ ? set.b : set.a];
  sets.insert(sets.begin(), std::move(result));
  if (sets.size() > kKeptVersions) sets.pop_back();
  return true;
}

std::vector<EdgeSetOffer> LocalGraph::offers() const {
  std::vector<EdgeSetOffer> offers;
  for (const auto& [peer, sets] : sets_)
    for (const EdgeSet& set : sets)
      if (!set.edges.empty())
        offers.push_back({peer, static_cast<std::uint32_t>(set.edges.size()), set.id});
  return offers;
}

const std::vector<InterEdge>* LocalGraph::edges(RobotId peer, const EdgeSetId& id) const {
  const auto sets = sets_.find(peer);
  if (sets == sets_.end()) return nullptr;
  for (const EdgeSet& set : sets->second)
    if (set.id == id) return &set.edges;
  return nullptr;
}

const std::vector<InterEdge>* LocalGraph::newest_edges(RobotId peer) const {
  const auto sets = sets_.find(peer);
  return sets == sets_.end() ? nullptr : &sets->second.front().edges;
}

std::vector<BlockEdge> LocalGraph::own_edges() const {
  std::vector<BlockEdge> edges = odometry_;
  edges.insert(edges.end(), intra_.begin(), intra_.end());
  return edges;
}

}  // namespace km
