#include <catch2/catch.hpp>

#include <random>
#include <vector>

#include "modules/outlier_rejection/clique_heuristic.hpp"
#include "modules/outlier_rejection/clique_search.hpp"
#include "test/modules/outlier_rejection/random_graph.hpp"

namespace km {
namespace {

using Vertices = std::vector<std::size_t>;

TEST_CASE("The greedy clique follows the degrees", "[clique]") {
  // A triangle 0 1 2 and a clique 0 3 4 5; 1 has the higher degree by its leaves 6 to 9.
  BitGraph graph(10);
  for (const auto& [u, v] : std::vector<std::pair<std::size_t, std::size_t>>{{0, 1},
                                                                             {0, 2},
                                                                             {1, 2},
                                                                             {0, 3},
                                                                             {0, 4},
                                                                             {0, 5},
                                                                             {3, 4},
                                                                             {3, 5},
                                                                             {4, 5},
                                                                             {1, 6},
                                                                             {1, 7},
                                                                             {1, 8},
                                                                             {1, 9}})
    graph.connect(u, v);
  CHECK(greedy_extension(graph, {0}, 0) == Vertices{0, 1, 2});  // misled by vertex 1
  CHECK(greedy_extension(graph, {0}, 3).empty());
  CHECK(greedy_extension(graph, {3}, 0) == Vertices{0, 3, 4, 5});
  CHECK(greedy_extension(graph, {6}, 0) == Vertices{1, 6});
  CHECK(greedy_extension(graph, {4, 0}, 0) == Vertices{0, 3, 4, 5});
  CHECK(greedy_clique(graph) == Vertices{0, 3, 4, 5});
}

TEST_CASE("What is greedily found is a clique with the vertex, and larger than asked", "[clique]") {
  const unsigned seed = GENERATE(range(0U, 20U));
  const double density = GENERATE(0.2, 0.5, 0.9);
  CAPTURE(seed, density);
  std::mt19937 rng(seed);
  const Rows rows = random_graph(60, density, rng);
  const BitGraph graph = bit_graph(rows);
  for (std::size_t v = 0; v < rows.size(); ++v) {
    const Vertices clique = greedy_extension(graph, {v}, 0);
    REQUIRE(is_clique(rows, clique));
    REQUIRE(std::ranges::binary_search(clique, v));
    CHECK(greedy_extension(graph, {v}, clique.size()).size() != clique.size());
  }
  const Vertices best = greedy_clique(graph);
  CHECK(is_clique(rows, best));
  Vertices all(rows.size());
  std::iota(all.begin(), all.end(), 0);
  const auto exact = find_clique(graph, all, {.enough = all.size(), .max_nodes = 1000000});
  CHECK(best.size() <= exact.clique.size());
}

TEST_CASE("A graph without vertices or edges has a greedy clique of its size, at most one",
          "[clique]") {
  CHECK(greedy_clique(BitGraph(0)).empty());
  CHECK(greedy_clique(BitGraph(3)) == Vertices{0});
}

}  // namespace
}  // namespace km
