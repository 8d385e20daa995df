#include "modules/tree_newton/closure_cover.hpp"

#include <algorithm>
#include <queue>
#include <set>
#include <utility>

#include "modules/tree_newton/block_matrix.hpp"

namespace km {
namespace {

using Neighbours = std::vector<std::vector<int>>;

// The ends of all closures, ascending, and the pairs of ends that closures connect, each pair once.
std::pair<std::vector<KeyframeId>, Neighbours> public_graph(std::span<const ClosureId> closures) {
  std::vector<KeyframeId> poses;
  for (const ClosureId& closure : closures) poses.insert(poses.end(), {closure.from, closure.to});
  std::sort(poses.begin(), poses.end());
  poses.erase(std::unique(poses.begin(), poses.end()), poses.end());
  const auto number = [&](const KeyframeId& id) {
    return static_cast<int>(std::lower_bound(poses.begin(), poses.end(), id) - poses.begin());
  };
  Neighbours neighbours(poses.size());
  for (const ClosureId& closure : closures) {
    const int a = number(closure.from);
    const int b = number(closure.to);
    neighbours[at(a)].push_back(b);
    neighbours[at(b)].push_back(a);
  }
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return {std::move(poses), std::move(neighbours)};
}

}  // namespace

std::vector<KeyframeId> cover_closures(std::span<const ClosureId> closures) {
  const auto [poses, neighbours] = public_graph(closures);
  std::vector<int> left(poses.size());  // number of uncovered closures
  std::priority_queue<std::pair<int, int>> queue;
  const auto offer = [&](int v) { queue.emplace(left[at(v)], -v); };
  for (std::size_t v = 0; v < poses.size(); ++v) {
    left[v] = static_cast<int>(neighbours[v].size());
    offer(static_cast<int>(v));
  }
  std::vector<bool> chosen(poses.size(), false);
  std::vector<int> order;
  while (!queue.empty()) {
    const auto [count, negative] = queue.top();
    queue.pop();
    const auto v = at(-negative);
    if (chosen[v] || count != left[v] || count == 0) continue;  // an outdated entry
    chosen[v] = true;
    order.push_back(-negative);
    for (const int u : neighbours[v]) {
      if (chosen[at(u)]) continue;
      --left[at(u)];
      offer(u);
    }
  }
  for (auto v = order.rbegin(); v != order.rend(); ++v) {
    const auto& around = neighbours[at(*v)];
    if (std::all_of(around.begin(), around.end(), [&](int u) { return chosen[at(u)]; }))
      chosen[at(*v)] = false;
  }
  std::vector<KeyframeId> cover;
  for (std::size_t v = 0; v < poses.size(); ++v)
    if (chosen[v]) cover.push_back(poses[v]);
  return cover;
}

std::vector<bool> weighed_closures(std::span<const ClosureId> closures, RobotId self, RobotId peer,
                                   std::optional<RobotId> child) {
  constexpr double kWorthIt = 1.5;
  const std::vector<KeyframeId> few = cover_closures(closures);
  std::set<KeyframeId> cover(few.begin(), few.end());
  if (child) {
    std::set<KeyframeId> ends;
    for (const ClosureId& closure : closures)
      ends.insert(closure.from.robot == *child ? closure.from : closure.to);
    if (static_cast<double>(ends.size()) <= kWorthIt * static_cast<double>(cover.size()))
      cover = std::move(ends);
  }
  std::vector<bool> weighs;
  for (const ClosureId& closure : closures) {
    const bool from = cover.contains(closure.from), to = cover.contains(closure.to);
    const bool here = closure.from.robot == self ? from : to;
    weighs.push_back(from && to ? self < peer : !here);
  }
  return weighs;
}

}  // namespace km
