#include "modules/outlier_rejection/pcm.hpp"
#include "test/modules/outlier_rejection/chain.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Half true closures with honest covariances, half random poses.
std::vector<Closure> mixed_closures(const TwoRobots& robots, std::size_t count, std::mt19937& rng) {
  std::uniform_int_distribution<std::size_t> pose(0, robots.a.size() - 1);
  std::vector<Closure> closures;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t i = pose(rng);
    const std::size_t j = pose(rng);
    closures.push_back(robots.measure(i, j, 0.02, rng));
    if (n % 2 == 1) closures.back().T_from_to = random_pose(rng);
  }
  return closures;
}

TEST_CASE("PCM keeps the true closures among as many random ones") {
  const unsigned seed = GENERATE(range(0U, 10U));
  const bool reverse_some = GENERATE(false, true);
  CAPTURE(seed, reverse_some);
  std::mt19937 rng(seed);
  const TwoRobots robots(12, 3, 40, 0.01, rng);
  std::vector<Closure> closures = mixed_closures(robots, 40, rng);
  PcmConfig config;
  config.confidence = 0.99999;  // 190 pairs of true closures: none may fail by chance
  Pcm pcm(3, 12, config);
  std::vector<ClosureId> truth;
  for (std::size_t n = 0; n < closures.size(); ++n) {
    if (reverse_some && n % 3 == 0) closures[n] = reversed(closures[n]);
    if (pcm.add(closures[n]) == PcmAddResult::kRepeated) continue;
    if (n % 2 == 0) truth.push_back(closures[n].id());
  }
  std::sort(truth.begin(), truth.end());
  CHECK(pcm.inliers() == truth);
  CHECK(pcm.clique().proven());
}

TEST_CASE("A pair of keyframes counts once, from whichever side it is measured") {
  std::mt19937 rng(1);
  const TwoRobots robots(0, 1, 5, 0.01, rng);
  PcmConfig config{.min_inliers = 1};
  Pcm pcm(0, 1, config);
  const Closure measured = robots.measure(2, 3, 0.02, rng);
  CHECK(pcm.add(measured) == PcmAddResult::kGrew);
  CHECK(pcm.add(measured) == PcmAddResult::kRepeated);
  CHECK(pcm.add(reversed(measured)) == PcmAddResult::kRepeated);
  CHECK(pcm.inliers() == std::vector<ClosureId>{measured.id()});
}

TEST_CASE("Fewer closures than min_inliers are not published") {
  std::mt19937 rng(1);
  const TwoRobots robots(0, 1, 5, 0.001, rng);
  PcmConfig config{.confidence = 0.9999, .min_inliers = 3};
  Pcm pcm(0, 1, config);
  for (std::size_t n = 0; n < 3; ++n) {
    CHECK(pcm.inliers().empty());
    CHECK(pcm.add(robots.measure(n, n + 1, 0.001, rng)) == PcmAddResult::kGrew);
  }
  CHECK(pcm.inliers().size() == 3);
}

TEST_CASE("PCM refuses closures it cannot weigh and keeps its state") {
  std::mt19937 rng(1);
  const TwoRobots robots(0, 1, 5, 0.01, rng);
  Pcm pcm(0, 1, PcmConfig{});
  const Closure good = robots.measure(2, 3, 0.02, rng);
  const auto check_refused = [&](const char* what, const auto& change) {
    CAPTURE(what);
    Closure bad = good;
    change(bad);
    CHECK_THROWS_AS(pcm.add(bad), std::invalid_argument);
    CHECK(pcm.size() == 0);
  };
  check_refused("another pair", [](Closure& c) { c.to.id.robot = 2; });
  check_refused("inside one robot", [](Closure& c) { c.to.id.robot = 0; });
  check_refused("not finite", [](Closure& c) { c.T_from_to.translation().x() = std::nan(""); });
  check_refused("not a rotation", [](Closure& c) { c.from.T_odom_kf.linear() *= 1.1; });
  check_refused("a reflection", [](Closure& c) { c.from.T_odom_kf.linear().col(0) *= -1.0; });
  check_refused("not a covariance", [](Closure& c) { c.covariance(2, 2) = -1.0; });
  CHECK(pcm.add(good) == PcmAddResult::kGrew);
}

}  // namespace
}  // namespace km
