#include "modules/tree_newton/elimination_plan.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <stdexcept>
#include <string>

namespace km {
namespace {

// Largest share of stored zeros with which a front is merged with its last child. Two fronts with
// at most kSmallFront columns together are merged with up to half zeros, because dense kernels on a
// few columns cost less than the bookkeeping of two fronts.
constexpr double kToleratedZeros = 0.15;
constexpr int kSmallFront = 4;

using Neighbours = std::vector<std::vector<int>>;

Neighbours neighbours_of(int nodes, const std::vector<NodePair>& pairs) {
  Neighbours neighbours(at(nodes));
  for (const auto& [i, j] : pairs) {
    neighbours[at(i)].push_back(j);
    neighbours[at(j)].push_back(i);
  }
  return neighbours;
}

// The nodes without the kept ones, in the order of approximate minimum degree.
std::vector<int> fill_reducing_order(const std::vector<bool>& keep,
                                     const std::vector<NodePair>& pairs) {
  std::vector<int> number(keep.size(), -1);
  std::vector<int> eliminated;
  for (std::size_t v = 0; v < keep.size(); ++v) {
    if (keep[v]) continue;
    number[v] = static_cast<int>(eliminated.size());
    eliminated.push_back(static_cast<int>(v));
  }
  const auto n = static_cast<int>(eliminated.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(eliminated.size() + pairs.size());
  for (int i = 0; i < n; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [a, b] : pairs) {
    const int i = number[at(a)];
    const int j = number[at(b)];
    if (i < 0 || j < 0) continue;
    entries.emplace_back(i, j, 1.0);
    entries.emplace_back(j, i, 1.0);
  }
  Eigen::SparseMatrix<double> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order(n);
  if (n > 0) Eigen::AMDOrdering<int>()(pattern, order);
  std::vector<int> result;
  result.reserve(eliminated.size());
  for (int k = 0; k < n; ++k) result.push_back(eliminated[at(order.indices()(k))]);
  return result;
}

// Columns of the factor by place in the order; kept nodes come after all others. The parent of a
// column is its first place below the diagonal, or -1 if that is a kept node.
struct Columns {
  Neighbours below = {};  // ascending places
  std::vector<int> parent = {};
};

Columns fill(const std::vector<int>& place, std::size_t eliminated, const Neighbours& neighbours,
             const std::vector<int>& order) {
  Columns columns{Neighbours(eliminated), std::vector<int>(eliminated, -1)};
  Neighbours children(eliminated);
  std::vector<int> mark(place.size(), -1);
  for (std::size_t c = 0; c < eliminated; ++c) {
    const auto here = static_cast<int>(c);
    std::vector<int>& below = columns.below[c];
    const auto add = [&](int row) {
      if (row <= here || mark[at(row)] == here) return;
      mark[at(row)] = here;
      below.push_back(row);
    };
    for (const int v : neighbours[at(order[c])]) add(place[at(v)]);
    for (const int child : children[c])
      for (const int row : columns.below[at(child)]) add(row);
    std::sort(below.begin(), below.end());
    if (below.empty() || below.front() >= static_cast<int>(eliminated)) continue;
    columns.parent[c] = below.front();
    children[at(below.front())].push_back(here);
  }
  return columns;
}

// Reorders so that every column follows its subtree directly. The last child of a front is then the
// run of columns just before its own.
std::vector<int> postorder(const std::vector<int>& parent) {
  Neighbours children(parent.size());
  std::vector<int> roots;
  for (std::size_t c = 0; c < parent.size(); ++c)
    (parent[c] < 0 ? roots : children[at(parent[c])]).push_back(static_cast<int>(c));
  std::vector<int> order;
  std::vector<std::pair<int, std::size_t>> path;
  for (const int root : roots) {
    path.emplace_back(root, 0);
    while (!path.empty()) {
      auto& [column, next] = path.back();
      const auto& below = children[at(column)];
      if (next < below.size()) {
        path.emplace_back(below[next++], 0);
      } else {
        order.push_back(column);
        path.pop_back();
      }
    }
  }
  return order;
}

// A run of columns eliminated together: `first` to `first + columns`, and the rows below them.
struct Run {
  int first = 0;
  int columns = 0;
  double zeros = 0.0;
  std::vector<int> below = {};
};

bool worth_merging(const Run& child, const Run& front, double& zeros) {
  const double rows = front.columns + static_cast<double>(front.below.size());
  zeros =
      child.zeros + front.zeros + child.columns * (rows - static_cast<double>(child.below.size()));
  const int columns = child.columns + front.columns;
  const double size = 0.5 * columns * (columns + 1.0) +
                      static_cast<double>(columns) * static_cast<double>(front.below.size());
  return zeros <= kToleratedZeros * size || (columns <= kSmallFront && zeros <= 0.5 * size);
}

std::vector<Run> merge_columns(const Columns& columns) {
  std::vector<Run> runs;
  for (std::size_t c = 0; c < columns.below.size(); ++c) {
    Run run{static_cast<int>(c), 1, 0.0, columns.below[c]};
    while (!runs.empty()) {
      const Run& last = runs.back();
      const int last_column = last.first + last.columns - 1;
      double zeros = 0.0;
      if (last_column + 1 != run.first || columns.parent[at(last_column)] != run.first ||
          !worth_merging(last, run, zeros))
        break;
      run.first = last.first;
      run.columns += last.columns;
      run.zeros = zeros;
      runs.pop_back();
    }
    runs.push_back(std::move(run));
  }
  return runs;
}

}  // namespace

EliminationPlan::EliminationPlan(std::vector<bool> keep, std::vector<NodePair> pairs)
    : keep_(std::move(keep)), pairs_(std::move(pairs)), place_of_kept_(keep_.size(), -1) {
  for (const auto& [i, j] : pairs_)
    if (i < 0 || j < 0 || i >= nodes() || j >= nodes() || i == j)
      throw std::invalid_argument("EliminationPlan: pair " + std::to_string(i) + ' ' +
                                  std::to_string(j) + " names no two nodes");
  for (int v = 0; v < nodes(); ++v) {
    if (!keep_[at(v)]) continue;
    place_of_kept_[at(v)] = static_cast<int>(kept_.size());
    kept_.push_back(v);
  }
  order_and_fill();
  find_kept_pairs();
}

void EliminationPlan::order_and_fill() {
  const Neighbours neighbours = neighbours_of(nodes(), pairs_);
  std::vector<int> order = fill_reducing_order(keep_, pairs_);
  const std::size_t eliminated = order.size();
  order.insert(order.end(), kept_.begin(), kept_.end());
  std::vector<int> place(order.size());
  const auto number_places = [&] {
    for (std::size_t k = 0; k < order.size(); ++k) place[at(order[k])] = static_cast<int>(k);
  };
  number_places();
  const std::vector<int> column_order =
      postorder(fill(place, eliminated, neighbours, order).parent);
  const std::vector<int> before = order;
  for (std::size_t k = 0; k < eliminated; ++k) order[k] = before[at(column_order[k])];
  number_places();
  const std::vector<Run> runs = merge_columns(fill(place, eliminated, neighbours, order));

  std::vector<int> front_of(eliminated);
  for (const Run& run : runs) {
    for (int c = 0; c < run.columns; ++c)
      front_of[at(run.first + c)] = static_cast<int>(fronts_.size());
    Front& front = fronts_.emplace_back();
    front.pivots = run.columns;
    for (int c = 0; c < run.columns; ++c) front.nodes.push_back(order[at(run.first + c)]);
    for (const int row : run.below) front.nodes.push_back(order[at(row)]);
  }
  for (std::size_t f = 0; f < runs.size(); ++f) {
    const auto& below = runs[f].below;
    if (below.empty() || below.front() >= static_cast<int>(eliminated)) continue;
    fronts_[f].parent = front_of[at(below.front())];
    fronts_[at(fronts_[f].parent)].children.push_back(static_cast<int>(f));
  }
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const auto first = at(std::min(place[at(pairs_[p][0])], place[at(pairs_[p][1])]));
    if (first < eliminated) fronts_[at(front_of[first])].pairs.push_back(static_cast<int>(p));
  }
}

void EliminationPlan::find_kept_pairs() {
  const auto add = [&](int i, int j) {
    const int a = place_of_kept_[at(i)];
    const int b = place_of_kept_[at(j)];
    kept_pairs_.push_back({std::min(a, b), std::max(a, b)});
  };
  for (const Front& front : fronts_) {
    if (front.parent >= 0) continue;
    const auto first = at(front.pivots);
    for (std::size_t i = first; i < front.nodes.size(); ++i)
      for (std::size_t j = i + 1; j < front.nodes.size(); ++j) add(front.nodes[i], front.nodes[j]);
  }
  for (const auto& [i, j] : pairs_)
    if (keep_[at(i)] && keep_[at(j)]) add(i, j);
  std::sort(kept_pairs_.begin(), kept_pairs_.end());
  kept_pairs_.erase(std::unique(kept_pairs_.begin(), kept_pairs_.end()), kept_pairs_.end());
}

}  // namespace km
