#include "modules/pose_graph/newton/robot_graph.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/pose_graph/newton/sparse_choice.hpp"

namespace km {
namespace {

[[noreturn]] void refuse(RobotId self, const std::string& what) {
  throw std::invalid_argument("RobotGraph of robot " + std::to_string(self) + ": " + what);
}

void check(const RobotEdges& robot, const BlockEdge& e) {
  if (e.i < 0 || e.j < 0 || e.i == e.j || e.i >= robot.poses || e.j >= robot.poses)
    refuse(robot.self, "an edge joins poses " + std::to_string(e.i) + " and " +
                           std::to_string(e.j) + " of " + std::to_string(robot.poses));
}

void check(const RobotEdges& robot, const VerticalPrior& v) {
  if (v.pose < 0 || v.pose >= robot.poses)
    refuse(robot.self, "a vertical prior names pose " + std::to_string(v.pose) + " of " +
                           std::to_string(robot.poses));
  if (!v.up.allFinite() || !(v.weight > 0.0) || !std::isfinite(v.weight))
    refuse(robot.self, "a vertical prior is not finite with a positive weight");
}

void check_measurement(RobotId self, const BlockEdge& e) {
  const bool usable = e.T_i_j.matrix().allFinite() && e.kappa > 0.0 && e.tau > 0.0 &&
                      std::isfinite(e.kappa) && std::isfinite(e.tau);
  if (!usable) refuse(self, "an edge is not finite with positive precisions");
}

// The couplings of edges, each once, and which one every edge belongs to.
std::vector<NodePair> couple(std::vector<RobotGraph::Edge>& edges) {
  std::vector<NodePair> pairs;
  const auto pair_of = [](const RobotGraph::Edge& e) {
    return NodePair{static_cast<int>(std::min(e.i, e.j)), static_cast<int>(std::max(e.i, e.j))};
  };
  for (const auto& e : edges) pairs.push_back(pair_of(e));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (auto& e : edges) {
    e.pair =
        static_cast<int>(std::lower_bound(pairs.begin(), pairs.end(), pair_of(e)) - pairs.begin());
    e.transposed = e.i > e.j;
  }
  return pairs;
}

}  // namespace

std::vector<PublicLink> links_of(const RobotEdges& edges) {
  std::vector<PublicLink> links;
  for (const auto& [peer, list] : edges.to)
    if (peer > edges.self)
      for (const InterEdge& e : list) links.push_back({{edges.self, e.own}, {peer, e.other}});
  std::sort(links.begin(), links.end());
  links.erase(std::unique(links.begin(), links.end()), links.end());
  return links;
}

void RobotGraph::add_edges_between(const RobotEdges& robot, std::span<const KeyframeId> cover,
                                   std::vector<bool>& keep) {
  const auto covered = [&](const KeyframeId& id) {
    return std::binary_search(cover.begin(), cover.end(), id);
  };
  std::map<KeyframeId, Eigen::Index> foreign;
  for (const auto& [peer, list] : robot.to) {
    for (const InterEdge& e : list) {
      const std::string name = "an edge to robot " + std::to_string(peer);
      if (e.own >= robot.poses)
        refuse(robot.self, name + " names pose " + std::to_string(e.own) + " of " +
                               std::to_string(robot.poses));
      const KeyframeId other{peer, e.other};
      const bool own_covered = covered({robot.self, e.own});
      const bool other_covered = covered(other);
      if (!own_covered && !other_covered) refuse(robot.self, name + " has no end in the cover");
      if (!other_covered || (own_covered && peer < robot.self)) continue;  // the peer's
      const auto [node, added] = foreign.try_emplace(other, static_cast<Eigen::Index>(ids_.size()));
      if (added) {
        ids_.push_back(other);
        keep.push_back(true);
      }
      const Eigen::Index own = e.own;
      edges_.push_back({{e.from_own ? own : node->second, e.from_own ? node->second : own,
                         e.T_from_to, e.kappa, e.tau}});
    }
  }
}

RobotGraph::RobotGraph(const RobotEdges& robot, std::span<const KeyframeId> cover, Keep policy) {
  if (robot.poses < 1) refuse(robot.self, "it has no poses");
  for (Eigen::Index v = 0; v < robot.poses; ++v)
    ids_.push_back({robot.self, static_cast<KeyframeIndex>(v)});
  std::vector<bool> keep(ids_.size(), false);
  for (std::size_t v = 0; v < keep.size(); ++v)
    keep[v] = std::binary_search(cover.begin(), cover.end(), ids_[v]);
  if (cover.empty() && !keep.empty()) keep[keep.size() / 2] = true;
  for (const BlockEdge& e : robot.own) {
    check(robot, e);
    edges_.push_back({e});
  }
  add_edges_between(robot, cover, keep);
  for (const Edge& e : edges_) check_measurement(robot.self, e);
  for (const VerticalPrior& v : robot.verticals) check(robot, v);
  verticals_ = robot.verticals;
  const std::vector<NodePair> pairs = couple(edges_);
  if (policy == Keep::kSparse && !cover.empty()) keep = keep_sparse(std::move(keep), pairs);
  plan_ = std::make_shared<const EliminationPlan>(std::move(keep), pairs);
  find_kept_edges();
}

void RobotGraph::find_kept_edges() {
  const std::vector<int>& place = plan_->place_of_kept();
  const std::vector<NodePair>& pairs = plan_->kept_pairs();
  for (Edge& e : edges_) {
    const auto [a, b] =
        std::minmax(place[static_cast<std::size_t>(e.i)], place[static_cast<std::size_t>(e.j)]);
    if (a < 0) continue;
    const auto pair = std::lower_bound(pairs.begin(), pairs.end(), NodePair{a, b});
    e.kept_pair = static_cast<int>(pair - pairs.begin());
  }
}

void RobotGraph::set_precisions(std::span<const BlockEdge> own) {
  for (std::size_t k = 0; k < own.size(); ++k) {
    edges_[k].kappa = own[k].kappa;
    edges_[k].tau = own[k].tau;
  }
}

std::vector<KeyframeId> RobotGraph::kept() const {
  std::vector<KeyframeId> kept;
  for (const int node : plan_->kept()) kept.push_back(id(node));
  return kept;
}

}  // namespace km
