#include "modules/loop_closure/closure_odds.hpp"
#include "modules/loop_closure/request_policy.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Decision = RequestPolicy::Decision;

constexpr RobotId kSelf = 1;
constexpr RobotId kPeer = 2;

// So similar that it is requested, whatever has failed before.
LoopCandidate candidate(KeyframeIndex query, KeyframeIndex own, int support = 1,
                        RobotId peer = kPeer) {
  return {{peer, query}, {kSelf, own}, 2.0, support};
}

// Asks for `query`, which then leads to a closure with `own`.
void succeed(RequestPolicy& policy, KeyframeIndex query, KeyframeIndex own) {
  REQUIRE(policy.decide(candidate(query, own)) == Decision::kRequest);
  policy.add_closure({{kSelf, own}, {kPeer, query}});
  policy.add_result({kPeer, query}, true);
}

TEST_CASE("No keyframe near a closure is requested and the distance grows with successes") {
  LoopClosureConfig config{.max_closure_separation = 3, .max_request_separation = 0};
  RequestPolicy policy(config);
  for (KeyframeIndex successes = 1; successes <= 5; ++successes) {
    const KeyframeIndex query = 100 * successes;
    succeed(policy, query, 50);
    const KeyframeIndex covered = std::min<KeyframeIndex>(successes, 3);
    for (const int sign : {-1, 1}) {
      const auto beside = [&](KeyframeIndex d) {
        return query + static_cast<KeyframeIndex>(sign) * d;
      };
      CHECK(policy.decide(candidate(beside(covered), 50)) == Decision::kNearClosure);
      CHECK(policy.decide(candidate(query, 50 + static_cast<KeyframeIndex>(sign) * covered)) ==
            Decision::kNearClosure);
      CHECK(policy.decide(candidate(beside(covered + 1), 50)) == Decision::kRequest);
      CHECK(policy.decide(candidate(query, 50 + static_cast<KeyframeIndex>(sign) *
                                                    (covered + 1))) == Decision::kRequest);
    }
  }
  CHECK(policy.decide(candidate(100, 50, 1, kPeer + 1)) == Decision::kRequest);  // another robot
}

TEST_CASE("No keyframe near a requested one is requested") {
  LoopClosureConfig config{.max_request_separation = 2};
  RequestPolicy policy(config);
  REQUIRE(policy.decide(candidate(10, 20)) == Decision::kRequest);
  CHECK(policy.decide(candidate(12, 18)) == Decision::kRequest);  // no closure yet
  for (const KeyframeIndex query : {100U, 200U}) {
    policy.add_closure({{kSelf, query}, {kPeer, query}});
    REQUIRE(policy.decide(candidate(query, 300)) == Decision::kRequest);
    policy.add_result({kPeer, query}, true);
  }
  CHECK(policy.decide(candidate(12, 19)) == Decision::kNearRequest);
  CHECK(policy.decide(candidate(15, 20)) == Decision::kRequest);
  CHECK(policy.decide(candidate(10, 30)) == Decision::kRequest);  // another place
  CHECK(policy.decide(candidate(0, 0)) == Decision::kRequest);
}

TEST_CASE("A pair that the peer compares is not requested, and none beside it after a closure") {
  LoopClosureConfig config{.max_request_separation = 2};
  RequestPolicy policy(config);
  policy.add_peer_request(kPeer, 10, 20);
  CHECK(policy.decide(candidate(10, 20)) == Decision::kNearRequest);
  CHECK(policy.decide(candidate(10, 21)) == Decision::kRequest);
  CHECK(policy.decide(candidate(10, 20, 1, kPeer + 1)) == Decision::kRequest);
  policy.add_closure({{kSelf, 300}, {kPeer, 300}});
  policy.add_peer_request(kPeer, 100, 200);
  CHECK(policy.decide(candidate(101, 199)) == Decision::kNearRequest);
  CHECK(policy.decide(candidate(102, 200)) == Decision::kRequest);
}

TEST_CASE("A peer that requests without end is not listened to without end") {
  RequestPolicy policy{LoopClosureConfig{}};
  for (KeyframeIndex i = 0; i < 100'000; ++i) policy.add_peer_request(kPeer, i, 20);
  CHECK(policy.decide(candidate(99'999, 20)) == Decision::kNearRequest);
  policy.add_peer_request(kPeer, 200'000, 20);
  CHECK(policy.decide(candidate(200'000, 20)) == Decision::kRequest);
}

// Candidates that all fail.
int requests_among(RequestPolicy& policy, KeyframeIndex first, KeyframeIndex last) {
  int requests = 0;
  for (KeyframeIndex query = first; query < last; ++query) {
    const Decision decision = policy.decide({{kPeer, query}, {kSelf, 7}, 0.8, 3});
    CHECK((decision == Decision::kRequest || decision == Decision::kImprobable));
    if (decision != Decision::kRequest) continue;
    ++requests;
    policy.add_result({kPeer, query}, false);
  }
  return requests;
}

TEST_CASE("Candidates that fail are requested less and less often, more probable ones are not") {
  LoopClosureConfig config{.max_request_separation = 0};
  RequestPolicy policy(config);
  // After m failures p is about log(m) / m, so n queries cost about sqrt(n log(n)) requests.
  const int first = requests_among(policy, 0, 100);
  const int second = requests_among(policy, 100, 10'000);
  CHECK(first > 10);
  CHECK(second < 15 * first);
  CHECK(policy.decide({{kPeer, 10'000}, {kSelf, 7}, 1.4, 5}) == Decision::kRequest);
}

TEST_CASE("The candidates of one query count once, with the most probable one") {
  LoopClosureConfig config;
  config.max_closure_separation = config.max_request_separation = 0;
  config.min_closure_probability = 1.0;
  RequestPolicy policy(config);
  const auto decide = [&](KeyframeIndex query, KeyframeIndex own, double similarity) {
    return policy.decide({{kPeer, query}, {kSelf, own}, similarity, 2});
  };
  constexpr double kEven = 11.81 / 11.7;  // probability 0.5 before the first result
  for (KeyframeIndex query = 100; query < 103; ++query) succeed(policy, query, query);
  KeyframeIndex query = 200;
  while (query < 300 && decide(query, 7, kEven) == Decision::kRequest) ++query;
  // Half of a request is left. Further candidates of this query add nothing.
  for (KeyframeIndex own = 100; own < 110; ++own)
    CHECK(decide(query, own, 0.5) == Decision::kImprobable);
  CHECK(decide(query + 1, 7, kEven) == Decision::kRequest);
}

TEST_CASE("Robots without closures request less probable candidates") {
  LoopClosureConfig config;
  config.max_closure_separation = config.max_request_separation = 0;
  RequestPolicy policy(config);
  const auto decide = [&](KeyframeIndex query, double similarity) {
    return policy.decide({{kPeer, query}, {kSelf, 7}, similarity, 1});
  };
  constexpr double kTenth = 10.71 / 11.7;  // probability 0.1 before the first result
  for (KeyframeIndex query = 0; query < 50; ++query)
    CHECK(decide(query, kTenth) == Decision::kRequest);
  for (KeyframeIndex query = 50; query < 56; ++query)
    CHECK(decide(query, 0.1) == Decision::kRequest);
  CHECK(decide(56, 0.1) == Decision::kImprobable);
  for (KeyframeIndex query = 100; query < 103; ++query) succeed(policy, query, query);
  for (KeyframeIndex query = 200; query < 204; ++query)
    CHECK(decide(query, kTenth) == Decision::kImprobable);
}

TEST_CASE("A candidate whose probability is not a number is requested as one that is improbable") {
  RequestPolicy policy{LoopClosureConfig{}};
  for (KeyframeIndex query = 100; query < 400; query += 100) succeed(policy, query, query);
  int requests = 0;
  for (KeyframeIndex query = 1000; query < 3000; query += 100)
    requests += policy.decide({{kPeer, query}, {kSelf, 7}, std::nan(""), 1}) == Decision::kRequest;
  CHECK(requests <= 1);
}

LoopCandidate found_with(double similarity, int support) {
  return {.query = {2, 1}, .match = {1, 1}, .similarity = similarity, .support = support};
}

double logistic(double x) {
  return 1.0 / (1.0 + std::exp(-x));
}

double evidence_of(const LoopCandidate& c) {
  return 11.7 * c.similarity + 1.1 * c.support;
}

TEST_CASE("Similarity and support make a closure more probable") {
  const ClosureOdds odds;
  CHECK(odds.probability(found_with(12.9 / 11.7, 1)) == Approx(0.5));
  CHECK(odds.probability(found_with(1.0, 1)) == Approx(logistic(12.8 - 14.0)));
  CHECK(odds.probability(found_with(1.0, 4)) == Approx(logistic(16.1 - 14.0)));
  CHECK(odds.probability(found_with(1.0, 9)) == odds.probability(found_with(1.0, 5)));
}

TEST_CASE("The estimate is the maximum of the posterior distribution") {
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
