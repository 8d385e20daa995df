#include "modules/core/geometry/lie.hpp"
#include "modules/robust/odometry_noise.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kRotation = 0.005, kTranslation = 0.02;  // noise of a step and of a closure

// One robot that flies a circle of 50 keyframes six times. Closures join successive rounds.
struct Rounds {
  static constexpr std::uint32_t kRound = 50, kKeyframes = 300;

  std::mt19937 rng;
  int dimension;
  std::vector<SE3> truth;
  std::vector<PoseEdge> steps, closures;

  Rounds(unsigned seed, double odometry, std::uint32_t every, int in_dimension = 3)
      : rng(seed), dimension(in_dimension) {
    for (std::uint32_t k = 0; k < kKeyframes; ++k) {
      const double angle = 2.0 * 3.14159265358979 * k / kRound;
      truth.push_back(
          make_pose(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                    Eigen::Vector3d(8.0 * std::cos(angle), 8.0 * std::sin(angle), 0.0)));
    }
    for (std::uint32_t k = 0; k + 1 < kKeyframes; ++k) steps.push_back(edge(k, k + 1, odometry));
    for (std::uint32_t k = 0; k + kRound < kKeyframes; k += every)
      closures.push_back(edge(k, k + kRound, 1.0));
  }
  PoseEdge edge(std::uint32_t i, std::uint32_t j, double noise) {
    Vector6 xi = noise * random_vector<6>(rng);
    xi.head<3>() *= kRotation;
    xi.tail<3>() *= kTranslation;
    if (dimension == 2) xi(0) = xi(1) = xi(5) = 0.0;
    return {{0, i},
            {0, j},
            truth[i].inverse() * truth[j] * se3_exp(xi),
            {(dimension == 2 ? 1.0 : 0.5) / (kRotation * kRotation),
             1.0 / (kTranslation * kTranslation)}};
  }
  SE3 any_pose() {
    const SE3 T = random_pose(rng, 20.0);
    if (dimension == 3) return T;
    const double angle = 0.157 * T.translation().z();
    return make_pose(so3_exp({0.0, 0.0, angle}), {T.translation().x(), T.translation().y(), 0.0});
  }
  void add_false(std::size_t count) {
    std::uniform_int_distribution<std::uint32_t> lower(0, kKeyframes / 3),
        apart(20, kKeyframes / 2);
    while (count-- > 0) {
      const std::uint32_t from = lower(rng), to = from + apart(rng);
      closures.push_back({{0, from}, {0, to}, any_pose(), closures.front().precision});
    }
  }
  void jump(std::size_t step, const SE3& T) { steps[step].T_from_to = steps[step].T_from_to * T; }
};

const SE3 kJump = make_pose(so3_exp({0.0, 0.0, 0.3}), {0.5, -0.4, 0.0});

TEST_CASE("A wrong step of odometry is found and corrected") {
  const unsigned seed = GENERATE(range(1U, 11U));
  const std::size_t step = GENERATE(70, 149, 220);
  const std::size_t wrong = GENERATE(0, 6);  // false closures
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, step, wrong, dimension);
  Rounds rounds(seed, 1.0, 3, dimension);
  const SE3 before = rounds.steps[step].T_from_to;
  rounds.jump(step, kJump);
  rounds.add_false(wrong);
  const auto breaks = find_odometry_breaks(rounds.steps, rounds.closures, rounds.dimension);
  REQUIRE(breaks.size() == 1);
  // Places are up to 11 keyframes apart, and closures do not distinguish the steps between them.
  CHECK(std::abs(static_cast<double>(breaks[0].step) - static_cast<double>(step)) <= 11.0);
  CHECK(breaks[0].places >= 3);
  CHECK(breaks[0].jump_rad == Approx(0.3).margin(0.15));
  if (breaks[0].step != step) return;
  const Vector6 left = se3_log(before.inverse() * breaks[0].T_from_to);
  CHECK(left.head<3>().norm() < 0.15);
}

TEST_CASE("A wrong step keeps the weight of its correction in noisy odometry") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  Rounds rounds(seed, 5.0, 1);
  rounds.jump(149, make_pose(so3_exp({0.0, 0.0, 1.5}), {5.0, -4.0, 0.0}));
  const OdometryJudgement judgement =
      judge_odometry(rounds.steps, rounds.closures, rounds.dimension);
  REQUIRE(judgement.breaks.size() == 1);
  CHECK(judgement.noise.rotation > 2.0);
  std::vector<PoseEdge> corrected = rounds.steps;
  judgement.correct(corrected);
  for (std::size_t k = 0; k < corrected.size(); ++k) {
    const bool wrong = k == judgement.breaks[0].step;
    const Precision expected = wrong ? judgement.breaks[0].precision
                                     : judgement.noise.corrected(rounds.steps[k].precision);
    CHECK(corrected[k].precision.kappa == expected.kappa);
    CHECK(corrected[k].precision.tau == expected.tau);
  }
}

TEST_CASE("Two wrong steps are both found") {
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  Rounds rounds(seed, 1.0, 3);
  rounds.jump(80, kJump);
  rounds.jump(210, kJump.inverse());
  CHECK(find_odometry_breaks(rounds.steps, rounds.closures, rounds.dimension).size() == 2);
}

// No true closure spans the middle of the trajectory, and a row of false closures does: two parts
// of the environment look alike.
TEST_CASE("A row of false closures that agree is not a wrong step") {
  const unsigned seed = GENERATE(range(1U, 11U));
  const double apart_m = GENERATE(10.0, 70.0);
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, apart_m, dimension);
  Rounds rounds(seed, 1.0, 3, dimension);
  std::erase_if(rounds.closures, [](const PoseEdge& e) { return e.to.index > 150; });
  const SE3 alike = make_pose(so3_exp({0.0, 0.0, 2.5}), {apart_m, 0.0, 0.0});
  for (std::uint32_t k = 150; k < 200; k += 2) {
    PoseEdge wrong = rounds.edge(k, k + 90, 1.0);
    wrong.T_from_to = rounds.truth[k].inverse() * alike * rounds.truth[k + 90];
    rounds.closures.push_back(wrong);
  }
  CHECK(find_odometry_breaks(rounds.steps, rounds.closures, rounds.dimension).empty());
}

TEST_CASE("A wrong step may be long if it lasts long") {
  constexpr std::size_t kStep = 149;
  Rounds rounds(1, 1.0, 3);
  // The robot drove on for a fifth of a round, and its odometry stood still.
  for (std::size_t k = kStep + 1; k < rounds.truth.size(); ++k)
    rounds.truth[k] = rounds.truth[(k + 9) % rounds.truth.size()];
  rounds.closures.clear();
  for (std::uint32_t k = 0; k + 60 < Rounds::kKeyframes; k += 3)
    rounds.closures.push_back(rounds.edge(k, k + (k + 50 > kStep && k <= kStep ? 41 : 50), 1.0));
  std::vector<double> seconds(rounds.steps.size(), 1.0);
  CHECK(find_odometry_breaks(rounds.steps, rounds.closures, rounds.dimension, seconds).empty());
  seconds[kStep] = 10.0;
  const auto breaks =
      find_odometry_breaks(rounds.steps, rounds.closures, rounds.dimension, seconds);
  REQUIRE(breaks.size() == 1);
  CHECK(breaks[0].step == kStep);
}

TEST_CASE("Odometry without a wrong step has no break, however noisy it is") {
  const double odometry = GENERATE(1.0, 2.0, 5.0, 10.0);
  const std::size_t wrong = GENERATE(0, 10, 60);
  const int dimension = GENERATE(2, 3);
  std::size_t found = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    Rounds rounds(seed, odometry, 3, dimension);
    rounds.add_false(wrong);
    found += find_odometry_breaks(rounds.steps, rounds.closures, rounds.dimension).size();
  }
  CAPTURE(odometry, wrong, dimension);
  CHECK(found == 0);
}

}  // namespace
}  // namespace km
