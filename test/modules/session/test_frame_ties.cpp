#include "modules/session/frame_ties.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Robots = std::vector<RobotId>;

const Robots kMembers{0, 1, 2, 3, 4};

TeamStatus status_of(RobotId robot, std::vector<EdgeSetOffer> offers) {
  return {.sender = {robot, 1}, .offers = std::move(offers)};
}

}  // namespace

TEST_CASE("Robots that one place ties are tentative, with all robots behind them") {
  const std::vector<RobotTie> ties{{0, 1, 2}, {1, 2, 1}, {2, 3, 5}};
  CHECK(frame_ties(0, kMembers, ties) == FrameTies{{2, 3}, {4}});
  CHECK(frame_ties(3, kMembers, ties) == FrameTies{{0, 1}, {4}});
  CHECK(frame_ties(4, kMembers, ties) == FrameTies{{}, {0, 1, 2, 3}});
}

TEST_CASE("A circle of robots with one place for each pair is certain") {
  const std::vector<RobotTie> circle{{0, 1, 1}, {0, 4, 1}, {1, 2, 1}, {2, 3, 1}, {3, 4, 1}};
  for (const RobotId self : kMembers) CHECK(frame_ties(self, kMembers, circle) == FrameTies{});
  const std::span<const RobotTie> chain(circle.data() + 1, 4);
  CHECK(frame_ties(0, kMembers, chain) == FrameTies{{1, 2, 3, 4}, {}});
}

TEST_CASE("A single place that another one contradicts ties nothing, unless a circle confirms it") {
  const std::vector<RobotTie> chain{{0, 1, 2}, {1, 2, 1, true}, {2, 3, 1}};
  CHECK(frame_ties(0, kMembers, chain) == FrameTies{{}, {2, 3, 4}});
  CHECK(frame_ties(2, kMembers, chain) == FrameTies{{3}, {0, 1, 4}});
  const std::vector<RobotTie> circle{{0, 1, 1}, {0, 2, 1}, {1, 2, 1, true}};
  CHECK(frame_ties(0, kMembers, circle) == FrameTies{{}, {3, 4}});
}

TEST_CASE("Several places that others contradict tie nothing, not even in a circle") {
  const std::vector<RobotTie> chain{{0, 1, 2}, {1, 2, 4, true}, {2, 3, 2}};
  CHECK(frame_ties(0, kMembers, chain) == FrameTies{{}, {2, 3, 4}});
  CHECK(frame_ties(2, kMembers, chain) == FrameTies{{}, {0, 1, 4}});
  const std::vector<RobotTie> circle{{0, 1, 2, true}, {0, 2, 3, true}, {1, 2, 2, true}};
  CHECK(frame_ties(0, kMembers, circle) == FrameTies{{}, {1, 2, 3, 4}});
  const std::vector<RobotTie> detour{{0, 1, 2}, {0, 2, 3}, {1, 2, 2, true}};
  CHECK(frame_ties(0, kMembers, detour) == FrameTies{{}, {3, 4}});
}

TEST_CASE("Being tentative is mutual") {
  std::mt19937 rng(1);
  std::uniform_int_distribution<std::uint32_t> places(0, 2);
  const auto holds = [](const Robots& robots, RobotId id) {
    return std::ranges::binary_search(robots, id);
  };
  for (int n = 0; n < 200; ++n) {
    std::vector<RobotTie> ties;
    for (const RobotId a : kMembers)
      for (RobotId b = a + 1; b < 5; ++b)
        if (const auto count = places(rng) * places(rng) / 2; count > 0)
          ties.push_back({a, b, count, places(rng) == 0});
    for (const RobotId a : kMembers)
      for (const RobotId b : kMembers) {
        const FrameTies one = frame_ties(a, kMembers, ties), other = frame_ties(b, kMembers, ties);
        CHECK(holds(one.tentative, b) == holds(other.tentative, a));
        CHECK(holds(one.not_joined, b) == holds(other.not_joined, a));
      }
  }
}

TEST_CASE("The robots of a pair both report their places, and the lower number counts") {
  const std::map<RobotId, TeamStatus> statuses{
      {0, status_of(0, {{1, 9, {2, 7}, 3}, {1, 8, {1, 6}, 1}, {2, 1, {1, 5}, 1, true}})},
      {1, status_of(1, {{0, 9, {2, 7}, 2}, {2, 4, {1, 4}, 0}})},
      {2, status_of(2, {{0, 1, {1, 5}, 1}, {1, 4, {1, 4}, 1}, {7, 1, {1, 1}, 1}})}};
  CHECK(find_ties(statuses) == std::vector<RobotTie>{{0, 1, 2}, {0, 2, 1, true}});
}

}  // namespace km
