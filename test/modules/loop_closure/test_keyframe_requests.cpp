#include <algorithm>
#include <catch2/catch.hpp>

#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/loop_closure/request_policy.hpp"

namespace km {
namespace {

using Ids = std::vector<KeyframeId>;

TEST_CASE("a keyframe is asked for once, and again after the time-out", "[keyframe_requests]") {
  KeyframeRequests requests(2.0, 4);
  requests.want({7, 1});
  requests.want({7, 1});
  CHECK(requests.due(0.0) == Ids{{7, 1}});
  CHECK(requests.due(1.9).empty());
  CHECK(requests.due(2.0) == Ids{{7, 1}});
  CHECK(requests.arrived({7, 1}));
  CHECK(requests.due(100.0).empty());
  CHECK(requests.size() == 0);
}

TEST_CASE("the time-out doubles up to eightfold", "[keyframe_requests]") {
  KeyframeRequests requests(1.0, 4);
  requests.want({7, 1});
  std::vector<double> asked;
  for (int tick = 0; tick < 400; ++tick)
    if (!requests.due(0.1 * tick).empty()) asked.push_back(0.1 * tick);
  const std::vector<double> expected = {0.0, 1.0, 3.0, 7.0, 15.0, 23.0, 31.0, 39.0};
  REQUIRE(asked.size() == expected.size());
  for (std::size_t i = 0; i < asked.size(); ++i)
    CHECK(asked[i] == Approx(expected[i]).margin(0.15));
}

TEST_CASE("a peer that returns is asked at once", "[keyframe_requests]") {
  KeyframeRequests requests(1.0, 1);
  requests.want({7, 1});
  requests.want({8, 1});
  for (int tick = 0; tick < 10; ++tick) (void)requests.due(tick);
  REQUIRE(requests.due(10.5).empty());
  requests.returned(7);
  CHECK(requests.due(10.6) == Ids{{7, 1}});
}

TEST_CASE("the number of unanswered requests to one peer is bounded", "[keyframe_requests]") {
  KeyframeRequests requests(2.0, 2);
  for (std::uint32_t i = 0; i < 5; ++i) requests.want({7, i});
  requests.want({8, 0});
  CHECK(requests.due(0.0) == Ids{{7, 0}, {7, 1}, {8, 0}});
  CHECK(requests.arrived({7, 1}));
  CHECK(requests.due(0.1) == Ids{{7, 2}});
}

TEST_CASE("a keyframe that does not exist yet makes room and is tried later",
          "[keyframe_requests]") {
  KeyframeRequests requests(2.0, 1);
  requests.want({7, 9});
  requests.want({7, 1});
  REQUIRE(requests.due(0.0) == Ids{{7, 9}});
  requests.absent({7, 9}, 0.1);
  CHECK(requests.due(0.1) == Ids{{7, 1}});
  CHECK(requests.arrived({7, 1}));
  CHECK(requests.due(2.0).empty());
  CHECK(requests.due(2.1) == Ids{{7, 9}});
}

TEST_CASE("a late reply counts and a reply without a request does not", "[keyframe_requests]") {
  KeyframeRequests requests(2.0, 1);
  CHECK_FALSE(requests.arrived({7, 1}));
  requests.want({7, 1});
  CHECK_FALSE(requests.arrived({7, 1}));  // wanted, but not asked yet
  REQUIRE(requests.due(0.0).size() == 1);
  requests.absent({7, 1}, 0.1);
  CHECK(requests.arrived({7, 1}));
  CHECK_FALSE(requests.arrived({7, 1}));
  requests.absent({9, 1}, 0.2);  // unknown: nothing happens
  CHECK(requests.due(10.0).empty());
}

TEST_CASE("windows and time-outs must be positive", "[keyframe_requests]") {
  CHECK_THROWS_AS(KeyframeRequests(0.0, 1), std::invalid_argument);
  CHECK_THROWS_AS(KeyframeRequests(1.0, 0), std::invalid_argument);
}

TEST_CASE("the cache drops the keyframe used longest ago", "[keyframe_cache]") {
  KeyframeCache cache(2);
  const auto keyframe = [](std::uint32_t index) {
    Keyframe k;
    k.odometry.id = {7, index};
    return std::make_shared<const Keyframe>(k);
  };
  cache.put(keyframe(0));
  cache.put(keyframe(1));
  REQUIRE(cache.get({7, 0}));
  cache.put(keyframe(2));
  CHECK(cache.get({7, 0}));
  CHECK_FALSE(cache.get({7, 1}));
  CHECK(cache.get({7, 2}));
  cache.put(keyframe(2));  // again: nothing is pushed out
  CHECK(cache.get({7, 0}));
}

using Decision = RequestPolicy::Decision;

constexpr RobotId kSelf = 1;
constexpr RobotId kPeer = 2;

LoopCandidate candidate(KeyframeIndex query, KeyframeIndex own, int support = 1,
                        RobotId peer = kPeer) {
  return {{peer, query}, {kSelf, own}, 0.8, support};
}

// Asks for `query`, which then leads to a closure with `own`.
void succeed(RequestPolicy& policy, KeyframeIndex query, KeyframeIndex own) {
  REQUIRE(policy.decide(candidate(query, own)) == Decision::kRequest);
  policy.add_closure({{kSelf, own}, {kPeer, query}});
  policy.add_result({kPeer, query}, true);
}

TEST_CASE("No keyframe near a closure is requested and the distance grows with successes",
          "[request_policy]") {
  LoopClosureConfig config;
  config.max_closure_separation = 3;
  config.max_request_separation = 0;
  RequestPolicy policy(config);
  for (KeyframeIndex reach = 1; reach <= 5; ++reach) {
    const KeyframeIndex query = 100 * reach;
    succeed(policy, query, 50);
    const KeyframeIndex covered = std::min<KeyframeIndex>(reach, 3);
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

TEST_CASE("No keyframe near a requested one is requested", "[request_policy]") {
  LoopClosureConfig config;
  config.max_request_separation = 2;
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

TEST_CASE("A pair that the peer compares is not requested, and none beside it after a closure",
          "[request_policy]") {
  LoopClosureConfig config;
  config.max_request_separation = 2;
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

TEST_CASE("A peer that requests without end is not listened to without end", "[request_policy]") {
  RequestPolicy policy{LoopClosureConfig{}};
  for (KeyframeIndex i = 0; i < 100'000; ++i) policy.add_peer_request(kPeer, i, 20);
  CHECK(policy.decide(candidate(99'999, 20)) == Decision::kNearRequest);
  policy.add_peer_request(kPeer, 200'000, 20);
  CHECK(policy.decide(candidate(200'000, 20)) == Decision::kRequest);
}

TEST_CASE("Candidates of a kind that fails are requested less and less often, others are not",
          "[request_policy]") {
  LoopClosureConfig config;
  config.max_request_separation = 0;
  config.skips_per_failure = 1.0;
  RequestPolicy policy(config);
  int asked = 0;
  for (KeyframeIndex query = 0; query < 500; ++query) {
    const Decision decision = policy.decide(candidate(query, 7, 2));
    CHECK((decision == Decision::kRequest || decision == Decision::kLowYield));
    if (decision != Decision::kRequest) continue;
    ++asked;
    policy.add_result({kPeer, query}, false);
  }
  // Four are forgiven; then n are passed over after n failures: n (n + 1) / 2 queries for n
  // requests.
  CHECK(asked == 4 + 31);
  CHECK(policy.decide(candidate(500, 7, 5)) == Decision::kRequest);
  CHECK(policy.decide(candidate(501, 7, 9)) == Decision::kRequest);  // as with a support of 5
}

TEST_CASE("The candidates of one query count once", "[request_policy]") {
  LoopClosureConfig config;
  config.max_request_separation = 0;
  RequestPolicy policy(config);
  for (KeyframeIndex query = 0; query < 6; ++query) {
    while (policy.decide(candidate(query, 7)) != Decision::kRequest) ++query;
    policy.add_result({kPeer, query}, false);
  }
  for (KeyframeIndex own = 0; own < 10; ++own)
    CHECK(policy.decide(candidate(100, 10 * own)) == Decision::kLowYield);
}

TEST_CASE("With all bounds at 0 every candidate is requested", "[request_policy]") {
  LoopClosureConfig config;
  config.max_closure_separation = config.max_request_separation = 0;
  config.skips_per_failure = 0.0;
  RequestPolicy policy(config);
  succeed(policy, 1, 1);
  for (KeyframeIndex query = 2; query < 20; ++query) {
    CHECK(policy.decide(candidate(query, 1)) == Decision::kRequest);
    policy.add_result({kPeer, query}, false);
  }
}

}  // namespace
}  // namespace km
