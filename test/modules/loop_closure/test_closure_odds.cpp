#include "modules/loop_closure/closure_odds.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace km {
namespace {

LoopCandidate found_with(double similarity, int support) {
  return {.query = {2, 1}, .match = {1, 1}, .similarity = similarity, .support = support};
}

double logistic(double x) {
  return 1.0 / (1.0 + std::exp(-x));
}

double evidence_of(const LoopCandidate& c) {
  return 11.7 * c.similarity + 1.1 * c.support;
}

TEST_CASE("Similarity and support make a closure more probable", "[closure_odds]") {
  const ClosureOdds odds;
  CHECK(odds.probability(found_with(12.9 / 11.7, 1)) == Approx(0.5));
  CHECK(odds.probability(found_with(1.0, 1)) == Approx(logistic(12.8 - 14.0)));
  CHECK(odds.probability(found_with(1.0, 4)) == Approx(logistic(16.1 - 14.0)));
  CHECK(odds.probability(found_with(1.0, 9)) == odds.probability(found_with(1.0, 5)));
}

TEST_CASE("The estimate is the maximum of the posterior distribution", "[closure_odds]") {
  // Results as in a room: few closures among 40 requests.
  std::mt19937 engine(11);
  std::uniform_real_distribution<double> similarity(0.6, 1.1), unit(0.0, 1.0);
  std::uniform_int_distribution<int> support(1, 5);
  ClosureOdds odds;
  std::vector<std::pair<double, bool>> results;
  for (int i = 0; i < 40; ++i) {
    const LoopCandidate drawn = found_with(similarity(engine), support(engine));
    const bool verified = unit(engine) < logistic(evidence_of(drawn) - 15.5);
    odds.add(drawn, verified);
    results.emplace_back(evidence_of(drawn), verified);
  }
  // Brute force. Candidates are rounded to quarters of a unit, so the two differ a little.
  double best = 0.0, most = -1e300;
  for (double d = 8.0; d < 24.0; d += 0.01) {
    double log_posterior = -0.5 * (d - 14.0) * (d - 14.0) / 4.0;
    for (const auto& [z, y] : results) log_posterior += std::log(logistic(y ? z - d : d - z));
    if (log_posterior > most) most = log_posterior, best = d;
  }
  CHECK(odds.probability(found_with(1.0, 3)) == Approx(logistic(15.0 - best)).margin(0.03));
}

}  // namespace
}  // namespace km
