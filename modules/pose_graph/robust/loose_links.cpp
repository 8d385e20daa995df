#include "modules/pose_graph/robust/loose_links.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

namespace km {
namespace {

constexpr Eigen::Index kBeside = 3;  // public poses, at both ends
constexpr std::size_t kFew = 32;

using Links = std::vector<PublicGraph::Link>;

Eigen::Index end_in(const PublicGraph::Link& e, bool lower) {
  return lower ? std::min(e.i, e.j) : std::max(e.i, e.j);
}

}  // namespace

std::vector<bool> loose_links(const PublicGraph& graph) {
  const Links& links = graph.links();
  std::multimap<Eigen::Index, std::size_t> by_lower;  // links by their lower end
  for (std::size_t k = 0; k < links.size(); ++k) by_lower.emplace(end_in(links[k], true), k);
  std::vector<bool> loose(links.size(), false);
  for (std::size_t k = 0; k < links.size(); ++k) {
    const Eigen::Index lower = end_in(links[k], true);
    const Eigen::Index upper = end_in(links[k], false);
    const auto end = by_lower.upper_bound(lower + kBeside);
    loose[k] = !links[k].odometry &&
               std::none_of(by_lower.lower_bound(lower - kBeside), end, [&](const auto& entry) {
                 const PublicGraph::Link& other = links[entry.second];
                 return entry.second != k && other.a == links[k].a && other.b == links[k].b &&
                        std::abs(end_in(other, false) - upper) <= kBeside;
               });
  }
  if (static_cast<std::size_t>(std::count(loose.begin(), loose.end(), true)) <= kFew)
    loose.assign(links.size(), false);
  return loose;
}

std::vector<int> nodes_to_hold(const PublicGraph& graph, const std::vector<bool>& loose,
                               std::span<const double> weights) {
  std::map<RobotId, RobotId> part;  // named after one of its robots
  for (const auto& [robot, size] : graph.sizes()) part[robot] = robot;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const PublicGraph::Link& e = graph.links()[k];
    if (loose[k] || weights[k] == 0.0 || part[e.a] == part[e.b]) continue;
    const RobotId gone = part[e.b];
    for (auto& [robot, name] : part)
      if (name == gone) name = part[e.a];
  }
  std::set<RobotId> held;
  for (const auto& [robot, size] : graph.sizes()) {
    const int middle = graph.nodes() / 2 - graph.first(robot);
    if (middle >= 0 && middle < size) held.insert(part[robot]);
  }
  std::vector<int> nodes;
  for (const auto& [robot, name] : part)
    if (held.insert(name).second) nodes.push_back(graph.first(robot));
  return nodes;
}

}  // namespace km
