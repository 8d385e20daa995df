#include "modules/robust/tree_root.hpp"

#include "modules/robust/odometry_evidence.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// The decision of the root at the start of a team of four, whose pairs have these noise factors.
TreeVerdict start_with(const std::vector<float>& noise) {
  TreeRoot root({0, 1, 2, 3}, {}, false);
  TreeSums sums{.open = 100, .poses = 100};
  NoiseHistogram consistent;
  for (const double length : {2.0, 2.2, 2.4, 2.6, 2.8})
    for (int k = 0; k < 50; ++k) count_length(consistent, length);
  sums.lengths = consistent;
  REQUIRE(root.decide_start(sums, 0).verdict.next == TreeVerdict::Next::kCount);
  const std::vector<std::pair<RobotId, RobotId>> pairs{{0, 1}, {0, 2}, {0, 3},
                                                       {1, 2}, {1, 3}, {2, 3}};
  for (std::size_t k = 0; k < noise.size(); ++k)
    sums.votes.push_back({.a = pairs[k].first, .b = pairs[k].second, .noise = noise[k]});
  const DownMessage message = root.decide_start(sums, 1);
  REQUIRE(message.verdict.next == TreeVerdict::Next::kStart);
  return message.verdict;
}

// The start of a team of two with `open` closures, of which robots have decided `alone` alone.
TreeVerdict start_after(std::uint32_t open, std::uint32_t alone) {
  TreeRoot root({0, 1}, {}, false);
  REQUIRE(root.decide_start({.open = open, .poses = 100}, 0).verdict.next ==
          TreeVerdict::Next::kCount);
  const DownMessage message = root.decide_start({.open = open - alone, .poses = 100}, 1);
  REQUIRE(message.verdict.next == TreeVerdict::Next::kStart);
  return message.verdict;
}

// The verdicts on the first two steps of a team of three, with the predicted decreases `first` and
// `second` of their cost of 2. Robot 0 is 8 times noisier than it claims, or `honest`. A robot may
// itself report noise.
std::array<TreeVerdict, 2> two_steps(double first, double second, bool honest, bool reported) {
  TreeRoot root({0, 1, 2}, {}, false, false, reported);
  TreeSums sums{.base_cost = 2.0, .cost = 2.0, .largest = 1e3F, .open = 100, .poses = 100};
  sums.largest_of_all = sums.largest;
  for (const RobotId other : {RobotId{1}, RobotId{2}}) {
    sums.votes.push_back({.a = 0, .b = other});
    sums.votes.back().odometry.resize(kNoiseLevels * kNoiseLevels);
    for (std::size_t k = 0; k < kNoiseLevels; ++k) {
      const bool noisy = !honest && k == 3;
      sums.votes.back().odometry[kNoiseLevels * k] = noisy ? 100.0F : 0.0F;
    }
  }
  TreeVerdict verdict;
  for (std::uint32_t round = 0; verdict.next != TreeVerdict::Next::kStart; ++round) {
    REQUIRE(round < 4);
    verdict = root.decide_start(sums, round).verdict;
    if (round == 0) REQUIRE(verdict.odometry.empty() == honest);
  }
  const std::vector<SE3> poses(2, SE3::Identity());
  TreeFront front({.poses = 2, .edges = {{.from = {0, 0}, .to = {0, 1}}}, .root = true});
  front.linearise(poses, Curvature::kGaussNewton);
  REQUIRE(front.factorise());
  (void)front.reduce(poses, {});
  std::array<TreeVerdict, 2> steps;
  for (std::uint32_t k = 0; k < 2; ++k) {
    sums.changed = sums.fractional = 50;
    sums.decrement = 2.0 * (k == 0 ? first : second);
    steps[k] = root.decide(sums, 10 + k, front, poses, true).verdict;
    REQUIRE(steps[k].next == TreeVerdict::Next::kStep);
  }
  return steps;
}

}  // namespace

TEST_CASE("Closures are weighed more strictly only near the minimum if odometry is noisy") {
  const auto waits = [](double first, double second, bool honest, bool reported = false) {
    const auto steps = two_steps(first, second, honest, reported);
    return steps[0].mu == steps[1].mu;
  };
  CHECK(waits(1.0, 1.0, false));
  CHECK_FALSE(waits(1.0, 0.1, false));
  CHECK_FALSE(waits(1.0, 1.0, true));
  CHECK(waits(1.0, 1.0, true, true));
}

TEST_CASE("Robots decide closures alone if these are a tenth of all") {
  CHECK_FALSE(start_after(100, 100).weigh_all);
  CHECK_FALSE(start_after(100, 10).weigh_all);
  CHECK(start_after(100, 9).weigh_all);
  CHECK(start_after(100, 0).weigh_all);
}

TEST_CASE("A robot alone, or a team that trusts closures, starts at once") {
  TreeRoot alone({3}, {}, false), trusting({0, 1}, {.robust = false}, false);
  for (TreeRoot* root : {&alone, &trusting})
    CHECK(root->decide_start({.open = 100, .poses = 100}, 0).verdict.next ==
          TreeVerdict::Next::kStart);
}

TEST_CASE("The usual noise of a pair is reached by most pairs") {
  CHECK(start_with({3.0F, 2.5F, 2.0F, 1.0F, 1.0F}).usual_noise == 2.0);
  CHECK(start_with({3.0F, 3.0F, 3.0F, 1.0F, 1.0F, 1.0F}).usual_noise == 1.0);
  // Pairs without an estimate count as 1, and two pairs are no majority.
  CHECK(start_with({3.0F, 3.0F, 3.0F, 0.0F, 0.0F, 0.0F}).usual_noise == 1.0);
  CHECK(start_with({3.0F, 3.0F}).usual_noise == 1.0);
  CHECK(start_with({0.5F, 0.5F, 0.5F}).usual_noise == 1.0);
}

}  // namespace km
