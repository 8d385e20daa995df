#include "modules/tree_newton/closure_cover.hpp"

#include <algorithm>
#include <queue>
#include <utility>

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
    neighbours[static_cast<std::size_t>(a)].push_back(b);
    neighbours[static_cast<std::size_t>(b)].push_back(a);
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
  const auto offer = [&](int v) { queue.emplace(left[static_cast<std::size_t>(v)], -v); };
  for (std::size_t v = 0; v < poses.size(); ++v) {
    left[v] = static_cast<int>(neighbours[v].size());
    offer(static_cast<int>(v));
  }
  std::vector<bool> chosen(poses.size(), false);
  std::vector<int> order;
  while (!queue.empty()) {
    const auto [count, negative] = queue.top();
    queue.pop();
    const auto v = static_cast<std::size_t>(-negative);
    if (chosen[v] || count != left[v] || count == 0) continue;  // an outdated entry
    chosen[v] = true;
    order.push_back(-negative);
    for (const int u : neighbours[v]) {
      if (chosen[static_cast<std::size_t>(u)]) continue;
      --left[static_cast<std::size_t>(u)];
      offer(u);
    }
  }
  for (auto v = order.rbegin(); v != order.rend(); ++v) {
    const auto& around = neighbours[static_cast<std::size_t>(*v)];
    if (std::all_of(around.begin(), around.end(),
                    [&](int u) { return chosen[static_cast<std::size_t>(u)]; }))
      chosen[static_cast<std::size_t>(*v)] = false;
  }
  std::vector<KeyframeId> cover;
  for (std::size_t v = 0; v < poses.size(); ++v)
    if (chosen[v]) cover.push_back(poses[v]);
  return cover;
}

}  // namespace km
