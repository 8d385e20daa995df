#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// A graph by the earlier neighbours of each vertex, ascending.
using Rows = std::vector<std::vector<std::size_t>>;

/// `n` vertices, every pair joined with probability `density`.
inline Rows random_graph(std::size_t n, double density, std::mt19937& rng) {
  std::bernoulli_distribution joined(density);
  Rows rows(n);
  for (std::size_t v = 0; v < n; ++v)
    for (std::size_t u = 0; u < v; ++u)
      if (joined(rng)) rows[v].push_back(u);
  return rows;
}

/// A random graph in which `k` random vertices are joined to each other; those, ascending.
inline std::pair<Rows, std::vector<std::size_t>> planted_clique(std::size_t n, std::size_t k,
                                                                double density, std::mt19937& rng) {
  Rows rows = random_graph(n, density, rng);
  std::vector<std::size_t> planted(n);
  std::iota(planted.begin(), planted.end(), 0);
  std::shuffle(planted.begin(), planted.end(), rng);
  planted.resize(k);
  std::sort(planted.begin(), planted.end());
  for (std::size_t i = 0; i < k; ++i) {
    std::vector<std::size_t>& row = rows[planted[i]];
    row.insert(row.end(), planted.begin(), planted.begin() + static_cast<std::ptrdiff_t>(i));
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
  }
  return {rows, planted};
}

inline BitGraph bit_graph(const Rows& rows, std::size_t vertices) {
  BitGraph graph(vertices);
  for (std::size_t v = 0; v < vertices; ++v)
    for (const std::size_t u : rows[v]) graph.connect(u, v);
  return graph;
}
inline BitGraph bit_graph(const Rows& rows) {
  return bit_graph(rows, rows.size());
}

/// The same graph with its vertices in another order: vertex v becomes place[v].
inline Rows reordered(const Rows& rows, const std::vector<std::size_t>& place) {
  Rows result(rows.size());
  for (std::size_t v = 0; v < rows.size(); ++v)
    for (const std::size_t u : rows[v])
      result[std::max(place[u], place[v])].push_back(std::min(place[u], place[v]));
  for (auto& row : result) std::sort(row.begin(), row.end());
  return result;
}

inline bool is_clique(const Rows& rows, std::span<const std::size_t> clique) {
  for (std::size_t i = 0; i < clique.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (!std::ranges::binary_search(rows[std::max(clique[i], clique[k])],
                                      std::min(clique[i], clique[k])))
        return false;
  return true;
}

/// Reads the number of vertices, then one line with the earlier neighbours of each.
inline Rows read_adjacency(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  Rows rows(std::stoul(line));
  for (auto& row : rows) {
    std::getline(in, line);
    std::istringstream numbers(line);
    for (std::size_t u = 0; numbers >> u;) row.push_back(u);
    std::sort(row.begin(), row.end());
  }
  return rows;
}

}  // namespace km
