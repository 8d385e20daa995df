#include <catch2/catch.hpp>

#include <chrono>
#include <cstdint>
#include <iostream>
#include <random>

#include "modules/outlier_rejection/max_clique.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "test/modules/outlier_rejection/chain.hpp"
#include "test/modules/outlier_rejection/random_graph.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 40U;

double seconds_of(const auto& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Prints the median and maximum time of the last 50 additions at every 250th vertex, and the whole.
void report(const char* title, const Rows& rows) {
  MaxClique clique(kNoLimit);
  std::vector<double> times;
  double total = 0.0;
  std::cout << title << '\n';
  for (const auto& row : rows) {
    times.push_back(seconds_of([&] { clique.add(row); }));
    total += times.back();
    if (times.size() % 250 != 0) continue;
    std::vector<double> last(times.end() - 50, times.end());
    std::sort(last.begin(), last.end());
    std::cout << "  " << times.size() << " vertices: clique " << clique.clique().size()
              << ", last 50 additions median " << last[25] * 1e6 << " us, max " << last[49] * 1e6
              << " us, all so far " << total * 1e3 << " ms, slowest "
              << *std::max_element(times.begin(), times.end()) * 1e3 << " ms, nodes "
              << clique.search_nodes() << '\n';
  }
}

TEST_CASE("Maximum clique, one vertex at a time", "[!benchmark]") {
  const auto file = shared_data("pose_graphs/outliers/consistency_1500.adjacency.txt");
  if (file) report("Manhattan, density 0.094", read_adjacency(*file));
  std::mt19937 rng(1);
  report("planted 150 among 1500, density 0.1", planted_clique(1500, 150, 0.1, rng).first);
  report("random, density 0.5", random_graph(250, 0.5, rng));
}

TEST_CASE("PCM, one closure at a time", "[!benchmark]") {
  std::mt19937 rng(1);
  const TwoRobots robots(0, 1, 300, 0.01, rng);
  std::uniform_int_distribution<std::size_t> pose(0, 299);
  std::vector<Closure> closures;
  while (closures.size() < 1500) {
    const std::size_t i = pose(rng);
    const std::size_t j = pose(rng);
    closures.push_back(robots.measure(i, j, 0.05, rng));
    if (closures.size() % 3 != 0) closures.back().T_from_to = random_pose(rng);
  }
  Pcm pcm(0, 1, PcmConfig{});
  std::vector<double> times;
  for (const Closure& closure : closures)
    times.push_back(seconds_of([&] { (void)pcm.add(closure); }));
  std::vector<double> last(times.end() - 50, times.end());
  std::sort(last.begin(), last.end());
  std::cout << "PCM with " << pcm.size() << " closures: last 50 additions median " << last[25] * 1e3
            << " ms, max " << last[49] * 1e3 << " ms; " << pcm.inliers().size() << " agree\n";
}

}  // namespace
}  // namespace km
