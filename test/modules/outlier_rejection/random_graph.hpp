#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <sstream>
#include <string>
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

inline BitGraph bit_graph(const Rows& rows, std::size_t vertices) {
  BitGraph graph(vertices);
  for (std::size_t v = 0; v < vertices; ++v)
    for (const std::size_t u : rows[v]) graph.connect(u, v);
  return graph;
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
