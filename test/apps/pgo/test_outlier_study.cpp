#include <algorithm>
#include <catch2/catch.hpp>
#include <set>

#include "apps/pgo/outlier_study.hpp"
#include "apps/pgo/pairwise_consistency.hpp"
#include "test/support/team_graphs.hpp"

namespace km {
namespace {

constexpr double kSigma = 0.01;

// Of a few hundred poses, with weights as its noise has them.
TeamGraph clean_graph(unsigned seed) {
  std::mt19937 rng(seed);
  TeamGraph graph = noisy_chain(90, 3, kSigma, rng);
  for (BlockEdge& e : graph.edges) {
    e.kappa = 0.5 / (kSigma * kSigma);
    e.tau = 1.0 / (kSigma * kSigma);
  }
  return graph;
}

TEST_CASE("false closures come after a graph's own edges, and from the seed alone", "[outliers]") {
  TeamGraph graph = clean_graph(1);
  graph.edges[1].kappa = 7.0;
  const TeamGraph spoiled = spoil(graph, 50, 4.0, 3);
  REQUIRE(spoiled.edges.size() == graph.edges.size() + 50);
  const TeamGraph again = spoil(graph, 50, 4.0, 3);
  std::set<double> kappas;
  for (std::size_t k = 0; k < spoiled.edges.size(); ++k) {
    const BlockEdge& e = spoiled.edges[k];
    CHECK(e.T_i_j.matrix() == again.edges[k].T_i_j.matrix());
    if (k < graph.edges.size()) continue;
    CHECK(std::abs(e.i - e.j) > 1);
    CHECK(e.T_i_j.translation().cwiseAbs().maxCoeff() <= 4.0);
    kappas.insert(e.kappa);
  }
  CHECK(kappas.contains(0.5 / (kSigma * kSigma)));
  CHECK(spoil(graph, 1, 4.0, 4).edges.back().T_i_j.matrix() !=
        spoiled.edges[graph.edges.size()].T_i_j.matrix());
  std::erase_if(graph.edges, [](const BlockEdge& e) { return e.j != e.i + 1; });
  CHECK_THROWS_AS(spoil(graph, 1, 4.0, 3), std::invalid_argument);
}

TEST_CASE("pairwise consistency keeps what agrees, robot pair by robot pair", "[outliers]") {
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  const std::size_t own_edges = clean_graph(seed).edges.size();
  const TeamGraph spoiled = spoil(clean_graph(seed), 40, 30.0, seed);
  const std::vector<bool> kept = pairwise_consistent(spoiled, {});
  std::size_t true_lost = 0, false_kept = 0;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (k >= own_edges && kept[k]) ++false_kept;
    if (k < own_edges && !kept[k]) ++true_lost;
  }
  CHECK(false_kept == 0);
  CHECK(true_lost < own_edges / 4);  // a pair of true ones passes at 99 % only
}

TEST_CASE("pairwise consistency counts in sigmas of the scale that it is told", "[outliers]") {
  TeamGraph modest = clean_graph(1);
  constexpr double kScale = 0.004;  // the graph says 250 times the noise that there is
  for (BlockEdge& e : modest.edges) {
    e.kappa *= kScale * kScale;
    e.tau *= kScale * kScale;
  }
  const auto kept = pairwise_consistent(spoil(clean_graph(1), 40, 30.0, 1), {});
  const TeamGraph spoiled = spoil(modest, 40, 30.0, 1);
  CHECK(pairwise_consistent(spoiled, {}, kScale) == kept);
  CHECK(pairwise_consistent(spoiled, {}) != kept);
}

TEST_CASE("a robot without odometry has no pairwise consistency", "[outliers]") {
  TeamGraph graph = clean_graph(1);
  std::erase_if(graph.edges, [](const BlockEdge& e) { return e.i == 4 && e.j == 5; });
  CHECK_THROWS_WITH(pairwise_consistent(graph, {}), Catch::Contains("0:5"));
}

TEST_CASE("what is rejected does not bend the map, what is kept does", "[outliers]") {
  const OutlierStudyOptions options{
      .shares_percent = {0.0, 30.0}, .methods = kRejections, .barc = 6.0};
  std::vector<std::size_t> told;
  const OutlierStudy study =
      run_outlier_study(clean_graph(5), options, {},
                        [&](std::size_t done, std::size_t all) { told.push_back(all - done); });
  CHECK(study.certified);
  CHECK(study.half_side_m > 1.0);
  REQUIRE(study.results.size() == 8);
  CHECK(told.size() == 9);
  CHECK(told.back() == 0);
  for (const OutlierResult& result : study.results) {
    CAPTURE(result.method, result.share_percent);
    CHECK(result.true_kept <= study.true_closures);
    if (result.share_percent == 0.0) CHECK(result.false_closures == 0);
    if (result.method == "none") {
      CHECK(result.true_kept == study.true_closures);
      CHECK(result.false_kept == result.false_closures);
      CHECK((result.rmse_m < 1e-4) == (result.share_percent == 0.0));
    } else {
      CHECK(result.decided);
      CHECK(result.false_kept == 0);
      CHECK(result.rmse_m < kSigma);  // true ones lost cost less than the noise of one
    }
    if (result.method == "newton") CHECK(result.true_kept == study.true_closures);
  }
}

}  // namespace
}  // namespace km
