#include "modules/outlier_rejection/witnessed_pair.hpp"
#include "test/modules/outlier_rejection/chain.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Two robots that drive along x; closures state the position of b in the frame of a.
struct Aisles {
  Chain a{0}, b{1};

  explicit Aisles(std::size_t keyframes) {
    for (std::size_t i = 1; i < keyframes; ++i) {
      a.step(rotz(0.0, 1.0));
      b.step(rotz(0.0, 1.0));
    }
  }

  // As if robot b had begun `offset_m` beside robot a.
  [[nodiscard]] Closure at(std::size_t i, std::size_t j, double offset_m = 0.0) const {
    const double ahead_m = static_cast<double>(j) - static_cast<double>(i);
    return closure(a.at(i), b.at(j), rotz(0.0, ahead_m, offset_m));
  }
};

TEST_CASE("Aliased neighbours seen from both sides are one witness") {
  const Aisles aisles(40);
  WitnessedPair pair(0, 1, PcmConfig{});
  for (const std::size_t i : {10U, 11U}) {
    const Closure seen = aisles.at(i, i + 20, 7.0);
    CHECK(pair.add(seen) != PcmAddResult::kRepeated);
    CHECK(pair.add(reversed(seen)) == PcmAddResult::kRepeated);
  }
  CHECK(pair.closures().size() == 2);
  CHECK(pair.witnesses() == 1);
  CHECK_FALSE(pair.is_witnessed());
}

TEST_CASE("A cluster of aliased keyframes does not join two robots, a second place does") {
  const Aisles aisles(60);
  WitnessedPair pair(0, 1, PcmConfig{});
  for (std::size_t i = 10; i <= 13; ++i)
    for (std::size_t j = 30; j <= 33; ++j) (void)pair.add(aisles.at(i, j));
  CHECK(pair.closures().size() == 16);
  CHECK_FALSE(pair.is_witnessed());
  CHECK(pair.add(aisles.at(50, 5, 7.0)) == PcmAddResult::kAdded);  // another place, contradicts
  CHECK_FALSE(pair.is_witnessed());
  CHECK(pair.add(aisles.at(14, 40)) == PcmAddResult::kGrew);  // near on robot a alone
  CHECK(pair.is_witnessed());
  CHECK(pair.closures().size() == 18);  // the optimiser weighs the one that contradicts
}

TEST_CASE("Without witnesses a constellation overrules a place that only looks alike") {
  const Aisles aisles(60);
  const auto seen = [&](std::size_t i, std::size_t j, double offset_m) {
    Closure closure = aisles.at(i, j, offset_m);
    closure.inliers = 70;
    return closure;
  };
  WitnessedPair pair(0, 1, PcmConfig{});
  for (const std::size_t j : {0U, 1U, 2U}) (void)pair.add(seen(26, j, 62.0));
  CHECK(pair.closures().size() == 3);
  const Closure constellation = aisles.at(50, 30);
  (void)pair.add(constellation);
  CHECK(pair.closures() == std::vector{constellation.id()});
  (void)pair.add(seen(49, 30, 0.0));  // beside it, and agrees
  CHECK(pair.closures().size() == 2);
  CHECK_FALSE(pair.is_witnessed());
  (void)pair.add(seen(40, 20, 0.0));
  CHECK(pair.is_witnessed());
  CHECK(pair.closures().size() == 6);  // the optimiser weighs those that contradict
}

TEST_CASE("Along a common stretch there is a witness every fourth keyframe") {
  const Aisles aisles(40);
  PcmConfig config{.min_witnesses = 1000};
  WitnessedPair pair(0, 1, config);
  for (std::size_t i = 0; i < 12; ++i) (void)pair.add(aisles.at(i, i));
  CHECK(pair.witnesses() == 3);
}

TEST_CASE("A pair of robots refuses closures beyond those that both keep") {
  const Aisles aisles(200);
  WitnessedPair pair(0, 1, PcmConfig{});
  for (std::size_t k = 0; k < Pcm::kMaxClosures; ++k)
    REQUIRE(pair.add(aisles.at(k / 100, k % 100)) != PcmAddResult::kFull);
  CHECK(pair.is_witnessed());
  CHECK(pair.add(aisles.at(150, 150)) == PcmAddResult::kFull);
  CHECK(pair.closures().size() == Pcm::kMaxClosures);
}

TEST_CASE("A robot that moves for hours in a known place has room for its newest closure") {
  constexpr std::size_t kLap = 100, kKeyframes = 2000;
  Chain robot(0);
  for (std::size_t i = 1; i < kKeyframes; ++i) robot.step(rotz(0.0, i % kLap == 0 ? -99.0 : 1.0));
  WitnessedPair pair(0, 0, PcmConfig{});
  std::size_t most = 0;
  // Five closures of each keyframe, as far as there are so many laps.
  for (std::size_t i = kLap; i < kKeyframes; ++i)
    for (std::size_t back = kLap; back <= std::min(i, 5 * kLap); back += kLap) {
      const ClosureId added = [&] {
        const Closure seen = closure(robot.at(i - back), robot.at(i), rotz(0.0, 0.0));
        (void)pair.add(seen);
        return seen.id();
      }();
      const auto kept = pair.closures();
      most = std::max(most, kept.size());
      REQUIRE(std::ranges::binary_search(kept, added));
    }
  CHECK(most <= Pcm::kMaxClosures);
  // All stretches of the run are still tied.
  std::set<KeyframeIndex> stretches;
  for (const ClosureId& id : pair.closures()) stretches.insert(id.to.index / 12);
  CHECK(stretches.size() == (kKeyframes - kLap) / 12 + 1);
}

}  // namespace
}  // namespace km
