#include "modules/loop_closure/keyframe_requests.hpp"

#include "test/support/test.hpp"

namespace km {
namespace {

using Ids = std::vector<KeyframeId>;

TEST_CASE("a keyframe is asked for once, and again after the time-out") {
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

TEST_CASE("the time-out doubles up to eightfold") {
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

TEST_CASE("the number of unanswered requests to one peer is bounded") {
  KeyframeRequests requests(2.0, 2);
  for (std::uint32_t i = 0; i < 5; ++i) requests.want({7, i});
  requests.want({8, 0});
  CHECK(requests.due(0.0) == Ids{{7, 0}, {7, 1}, {8, 0}});
  CHECK(requests.arrived({7, 1}));
  CHECK(requests.due(0.1) == Ids{{7, 2}});
}

TEST_CASE("a keyframe that does not exist yet makes room and is tried later") {
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

TEST_CASE("the first keyframe that does not exist yet is asked for most often") {
  KeyframeRequests requests(1.0, 2);
  for (const std::uint32_t index : {5U, 3U, 4U}) requests.want({7, index});
  std::map<std::uint32_t, int> asked;
  for (int tick = 0; tick < 640; ++tick)
    for (const KeyframeId& id : requests.due(0.1 * tick)) {
      ++asked[id.index];
      requests.absent(id, 0.1 * tick);
    }
  CHECK(asked[3] == 64);
  CHECK(asked[4] == 7);  // at 0, 1, 3, 7, 15, 31, 63 s
  CHECK(asked[5] == 7);
  // Once the first exists, the next one is due.
  CHECK(requests.arrived({7, 3}));
  CHECK(requests.due(65.0) == Ids{{7, 4}});
}

TEST_CASE("a late reply counts and a reply without a request does not") {
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

TEST_CASE("windows and time-outs must be positive") {
  CHECK_THROWS_AS(KeyframeRequests(0.0, 1), std::invalid_argument);
  CHECK_THROWS_AS(KeyframeRequests(1.0, 0), std::invalid_argument);
}

TEST_CASE("the cache drops the keyframe used longest ago") {
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

}  // namespace
}  // namespace km
