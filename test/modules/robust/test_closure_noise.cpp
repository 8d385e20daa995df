#include "modules/robust/closure_noise.hpp"
#include "modules/robust/corroboration.hpp"
#include "modules/robust/cycle_mixture.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/random_team.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kOdometrySigma = 0.02;  // odometry in a cycle, on each axis [rad], [m]
constexpr double kClosureSigma = 0.05;   // both closures together [rad], [m]
constexpr double kVolume_m3 = 1000.0;

struct OdometrySigma {  // in a cycle, on each axis [rad], [m]
  double claimed = kOdometrySigma;
  double actual = kOdometrySigma;
};

// Cycles whose closures are `scale` times noisier than they claim. Some cycles are false.
std::vector<NoiseCycle> draw_cycles(std::size_t count, double scale, double share_false,
                                    int dimension, std::mt19937& rng, OdometrySigma sigma = {}) {
  Matrix6 axes = Matrix6::Identity();
  if (dimension == 2) axes(0, 0) = axes(1, 1) = axes(5, 5) = 0.0;
  const Matrix6 odometry = sigma.claimed * sigma.claimed * axes;
  const Matrix6 closures = kClosureSigma * kClosureSigma * axes;
  std::bernoulli_distribution is_false(share_false);
  std::vector<NoiseCycle> cycles;
  for (std::size_t k = 0; k < count; ++k) {
    Vector6 e = std::hypot(sigma.actual, scale * kClosureSigma) * random_vector<6>(rng);
    if (is_false(rng)) {
      e = random_vector<6>(rng);
      e.tail<3>() *= 4.0;
    }
    e = axes * e;
    cycles.push_back(NoiseCycle::of(e, odometry, closures,
                                    log_density_if_false(e, kVolume_m3, dimension), dimension));
  }
  return cycles;
}

PairCycles pair_of(std::vector<NoiseCycle> inside, std::vector<NoiseCycle> between) {
  const auto places = static_cast<double>(std::max(inside.size(), between.size()));
  return {std::move(inside), std::move(between), places};
}

// The cycles of a pair of robots with eight true closures far from each other. The rotation noise
// of odometry and of closures is sqrt(2) times as large as claimed (see random_team()).
PairCycles random_pair(unsigned seed) {
  const SplitGraph graph = random_team(seed, {0, 1}, 40, {{0, 1}});
  std::map<KeyframeId, SE3> poses{{{0, 0}, SE3::Identity()}, {{1, 0}, SE3::Identity()}};
  std::map<RobotId, Precision> step;
  for (const RelativePose& e : graph.odometry) {
    poses[e.to] = poses.at(e.from) * e.T_from_to;
    step[e.from.robot] = precision_of(e.covariance);
  }
  std::vector<PoseEdge> closures;
  for (const RelativePose& e : graph.closures)
    closures.push_back({e.from, e.to, e.T_from_to, precision_of(e.covariance)});
  PairCycles cycles;
  const Corroboration::PoseOf pose = [&](const KeyframeId& id) { return poses.at(id); };
  Corroboration(closures, pose, step, 3).count_cycles(cycles);
  return cycles;
}

}  // namespace

TEST_CASE("Odometry that is noisier than it claims is no reason to distrust closures") {
  int distrusted = 0;
  for (unsigned seed = 0; seed < 2000; ++seed)
    if (estimate_closure_noise(random_pair(seed), 1.0) != 1.0) ++distrusted;
  CHECK(distrusted <= 10);  // 0.3 % of 4000 pairs
}

TEST_CASE("The noise of the closures of a pair is estimated in the presence of false closures") {
  const unsigned seed = GENERATE(range(1U, 6U));
  const double scale = GENERATE(3.0, 5.0, 10.0);
  const double share_false = GENERATE(0.0, 0.4);
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, scale, share_false, dimension);
  std::mt19937 rng(seed);
  const PairCycles cycles = pair_of(draw_cycles(100, scale, share_false, dimension, rng), {});
  const double found = estimate_closure_noise(cycles, 1.0);
  // 60 cycles of 3 axes determine a standard deviation to 5 %. The tolerance is three times this,
  // and the step of the grid.
  CHECK(found == Approx(scale).epsilon(0.25));
}

TEST_CASE("False closures that end near each other do not count as noise of true ones") {
  const unsigned seed = GENERATE(range(1U, 6U));
  const double share_false = GENERATE(0.74, 0.89, 0.95);
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, share_false, dimension);
  std::mt19937 rng(seed);
  const auto false_ones = static_cast<std::size_t>(200.0 * share_false);
  std::vector<NoiseCycle> cycles = draw_cycles(false_ones, 12.0, 0.2, dimension, rng);
  std::ranges::move(draw_cycles(200 - false_ones, 1.0, 0.0, dimension, rng),
                    std::back_inserter(cycles));
  CHECK(estimate_closure_noise(pair_of(std::move(cycles), {}), 1.0) == 1.0);
}

TEST_CASE("Closures that are as noisy as claimed keep the factor of the team") {
  const unsigned seed = GENERATE(range(1U, 21U));
  const double usual = GENERATE(0.5, 1.0, 4.0);
  CAPTURE(seed, usual);
  std::mt19937 rng(seed);
  const PairCycles cycles =
      pair_of(draw_cycles(80, usual, 0.3, 3, rng), draw_cycles(20, usual, 0.3, 3, rng));
  CHECK(estimate_closure_noise(cycles, usual) == usual);
}

TEST_CASE("Closures as noisy as they claim stand out in a team that claims far too much noise") {
  constexpr double kUsual = 0.005;
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const OdometrySigma odometry{.claimed = 0.5, .actual = kUsual * 0.5};  // closures claim 0.05
  const PairCycles usual = pair_of(draw_cycles(60, kUsual, 0.0, 3, rng, odometry), {});
  const PairCycles noisy = pair_of(draw_cycles(60, 1.0, 0.0, 3, rng, odometry), {});
  CHECK(estimate_closure_noise(usual, kUsual) == kUsual);
  CHECK(estimate_closure_noise(noisy, kUsual) == Approx(1.0).epsilon(0.25));
}

TEST_CASE("An error that the closures of a place share shows between places") {
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const PairCycles cycles =
      pair_of(draw_cycles(100, 1.0, 0.0, 3, rng), draw_cycles(30, 3.2, 0.0, 3, rng));
  CHECK(estimate_closure_noise(cycles, 1.0) == Approx(3.2).epsilon(0.25));
}

TEST_CASE("Few observations do not make closures noisy") {
  std::mt19937 rng(1);
  PairCycles cycles = pair_of(draw_cycles(40, 2.2, 0.0, 3, rng), {});
  CHECK(estimate_closure_noise(cycles, 1.0) > 1.7);
  cycles.places = 1.0;  // all cycles are one observation
  CHECK(estimate_closure_noise(cycles, 1.0) == 1.0);
  CHECK(estimate_closure_noise({}, 2.5) == 2.5);
}

TEST_CASE("Cycles between places exclude a noise factor if there are enough of them") {
  std::mt19937 rng(1);
  const PairCycles many = pair_of({}, draw_cycles(40, 1.0, 0.0, 3, rng));
  const PairCycles few = pair_of({}, draw_cycles(1, 1.0, 0.0, 3, rng));
  CHECK(excludes_noise(many, 3.0, 1.0));
  CHECK_FALSE(excludes_noise(many, 1.0, 3.0));
  CHECK_FALSE(excludes_noise(few, 3.0, 1.0));
  CHECK_FALSE(excludes_noise({}, 3.0, 1.0));
  CHECK(shows_noise(many));
  CHECK_FALSE(shows_noise(few));
}

TEST_CASE("The estimated share of true cycles equals the share in the data") {
  const double share = GENERATE(0.2, 0.5, 0.9);
  std::vector<double> log_ratio, weight;
  for (int k = 0; k < 100; ++k) {
    log_ratio.push_back(k < 100 * share ? 30.0 : -30.0);
    weight.push_back(1.0);
  }
  const CycleMixture mixture = fit_cycle_mixture(log_ratio, weight);
  CHECK(mixture.share == Approx(share).margin(1e-9));
  CHECK(mixture.true_probability(30.0) > 0.999);
  CHECK(mixture.true_probability(-30.0) < 0.001);
}

}  // namespace km
