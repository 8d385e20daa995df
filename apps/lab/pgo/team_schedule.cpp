#include "apps/lab/pgo/team_schedule.hpp"

#include <algorithm>
#include <numeric>
#include <set>
#include <stdexcept>

namespace km {

TeamNeighbours neighbours_in(const TeamGraph& graph) {
  std::vector<std::set<std::size_t>> sets(graph.robots());
  for (const BlockEdge& e : graph.edges) {
    const std::size_t a = graph.robot_of(e.i);
    const std::size_t b = graph.robot_of(e.j);
    if (a == b) continue;
    sets[a].insert(b);
    sets[b].insert(a);
  }
  TeamNeighbours neighbours;
  for (const auto& set : sets) neighbours.emplace_back(set.begin(), set.end());
  return neighbours;
}

std::vector<std::vector<std::size_t>> colours_of(const TeamNeighbours& neighbours) {
  std::vector<std::size_t> order(neighbours.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return neighbours[a].size() > neighbours[b].size();
  });
  std::vector<std::vector<std::size_t>> colours;
  for (const std::size_t k : order) {
    const auto is_free = [&](const std::vector<std::size_t>& members) {
      return std::none_of(members.begin(), members.end(), [&](std::size_t other) {
        return std::binary_search(neighbours[k].begin(), neighbours[k].end(), other);
      });
    };
    const auto found = std::find_if(colours.begin(), colours.end(), is_free);
    if (found == colours.end())
      colours.push_back({k});
    else
      found->push_back(k);
  }
  for (auto& members : colours) std::sort(members.begin(), members.end());
  return colours;
}

TeamTree breadth_first_tree(const TeamNeighbours& neighbours) {
  TeamTree tree{.order = {0}, .parent = std::vector<std::size_t>(neighbours.size(), 0)};
  std::set<std::size_t> reached{0};
  for (std::size_t at = 0; at < tree.order.size(); ++at)
    for (const std::size_t next : neighbours[tree.order[at]])
      if (reached.insert(next).second) {
        tree.parent[next] = tree.order[at];
        tree.order.push_back(next);
      }
  if (tree.order.size() != neighbours.size())
    throw std::invalid_argument("breadth_first_tree: robot 0 is not connected with all others");
  return tree;
}

}  // namespace km
