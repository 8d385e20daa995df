#include <bit>

#include "modules/outlier_rejection/clique_search.hpp"
#include "modules/outlier_rejection/max_clique.hpp"
#include "test/modules/outlier_rejection/random_graph.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Vertices = std::vector<std::size_t>;

constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 40U;

// Size of the maximum clique of the first n vertices, by trying every subset.
std::size_t brute_force(const Rows& rows, std::size_t n) {
  std::vector<unsigned> adjacent(n, 0);
  for (std::size_t v = 0; v < n; ++v)
    for (const std::size_t u : rows[v]) {
      adjacent[v] |= 1U << u;
      adjacent[u] |= 1U << v;
    }
  std::size_t best = 0;
  for (unsigned set = 0; set < 1U << n; ++set) {
    bool clique = true;
    for (std::size_t v = 0; v < n && clique; ++v)
      if ((set >> v & 1U) != 0) clique = (set & ~adjacent[v] & ~(1U << v)) == 0;
    if (clique) best = std::max(best, static_cast<std::size_t>(std::popcount(set)));
  }
  return best;
}

// The same from scratch by the search itself, over all vertices at once.
std::size_t from_scratch(const Rows& rows, std::size_t n) {
  std::vector<std::size_t> all(n);
  std::iota(all.begin(), all.end(), 0);
  return find_clique(bit_graph(rows, n), all, {.more_than = 0, .enough = n, .max_nodes = kNoLimit})
      .clique.size();
}

TEST_CASE("The clique is a maximum after every insertion, by brute force") {
  const double density = GENERATE(0.1, 0.3, 0.5, 0.7, 0.9);
  CAPTURE(density);
  for (unsigned seed = 0; seed < 500; ++seed) {
    CAPTURE(seed);
    std::mt19937 rng(seed);
    const Rows rows = random_graph(10, density, rng);
    MaxClique clique(kNoLimit);
    for (std::size_t n = 1; n <= rows.size(); ++n) {
      const std::size_t before = clique.clique().size();
      const bool grew = clique.add(rows[n - 1]);
      REQUIRE(clique.clique().size() == brute_force(rows, n));
      REQUIRE(grew == (clique.clique().size() > before));
      REQUIRE(is_clique(rows, clique.clique()));
      REQUIRE(clique.proven());
    }
  }
}

TEST_CASE("The bound is valid and the result a clique for all limits") {
  const std::uint64_t limit = GENERATE(1U, 3U, 10U);
  const double density = GENERATE(0.3, 0.6, 0.9);
  CAPTURE(limit, density);
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    std::mt19937 rng(seed);
    const Rows rows = random_graph(40, density, rng);
    MaxClique clique(limit), repeated(limit);
    for (std::size_t n = 1; n <= rows.size(); ++n) {
      clique.add(rows[n - 1]);
      repeated.add(rows[n - 1]);
      const std::size_t maximum = from_scratch(rows, n);
      REQUIRE(is_clique(rows, clique.clique()));
      REQUIRE(clique.clique().size() <= maximum);
      REQUIRE(clique.bound() >= maximum);
      if (clique.proven()) REQUIRE(clique.clique().size() == maximum);
      if (clique.searches_ended() == 0) REQUIRE(clique.proven());
      // Nodes are counted, not time.
      REQUIRE(std::ranges::equal(clique.clique(), repeated.clique()));
    }
  }
}

TEST_CASE("The older of equally large cliques is kept") {
  MaxClique clique(kNoLimit);  // 0-1, then 1-2, then 2-3
  CHECK(clique.add({}));
  for (const std::size_t v : {0U, 1U, 2U}) clique.add(std::vector<std::size_t>{v});
  CHECK(std::vector(clique.clique().begin(), clique.clique().end()) ==
        std::vector<std::size_t>{0, 1});
}

TEST_CASE("A clique as large as the bound is proven again") {
  std::mt19937 rng(5);
  const Rows rows = random_graph(60, 0.8, rng);
  MaxClique clique(1);
  for (const auto& row : rows) clique.add(row);
  REQUIRE_FALSE(clique.proven());
  // A clique apart from the rest, larger than any bound on that: its last vertices prove it.
  std::vector<std::size_t> planted;
  for (std::size_t v = rows.size(); v < 2 * rows.size() + 1; ++v) {
    clique.add(planted);
    planted.push_back(v);
  }
  CHECK(clique.proven());
  CHECK(std::ranges::equal(clique.clique(), planted));
}

TEST_CASE("Invalid neighbours are refused and change nothing") {
  MaxClique clique(kNoLimit);
  clique.add({});
  CHECK_THROWS_WITH(clique.add(std::vector<std::size_t>{1}), Contains("1 does not exist"));
  CHECK_THROWS_WITH(clique.add(std::vector<std::size_t>{0, 0}), Contains("given twice"));
  CHECK(clique.size() == 1);
  CHECK(clique.add(std::vector<std::size_t>{0}));
}

TEST_CASE("The consistency graph of Manhattan has the clique numbers PMC proves") {
  const auto file = shared_data("pose_graphs/outliers/consistency_1500.adjacency.txt");
  if (!file) return;
  const Rows rows = read_adjacency(*file);
  REQUIRE(rows.size() == 1500);
  MaxClique clique(kNoLimit);
  std::vector<std::size_t> sizes;
  for (const auto& row : rows) {
    clique.add(row);
    if (clique.size() % 250 == 0) sizes.push_back(clique.clique().size());
  }
  CHECK(sizes == std::vector<std::size_t>{41, 77, 106, 133, 156, 172});
  CHECK(is_clique(rows, clique.clique()));
}

TEST_CASE("The greedy clique follows the degrees") {
  // A triangle 0 1 2 and a clique 0 3 4 5; 1 has the higher degree by its leaves 6 to 9.
  const BitGraph graph =
      bit_graph({{}, {0}, {0, 1}, {0}, {0, 3}, {0, 3, 4}, {1}, {1}, {1}, {1}}, 10);
  CHECK(greedy_extension(graph, {0}, 0) == Vertices{0, 1, 2});  // misled by vertex 1
  CHECK(greedy_extension(graph, {0}, 3).empty());
  CHECK(greedy_extension(graph, {3}, 0) == Vertices{0, 3, 4, 5});
  CHECK(greedy_extension(graph, {6}, 0) == Vertices{1, 6});
  CHECK(greedy_extension(graph, {4, 0}, 0) == Vertices{0, 3, 4, 5});
}

}  // namespace
}  // namespace km
