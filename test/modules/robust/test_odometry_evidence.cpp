#include "modules/core/geometry/lie.hpp"
#include "modules/robust/odometry_evidence.hpp"
#include "modules/robust/tree_messages.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Robots on one helix each, with closures between them where they pass each other.
struct Helices {
  static constexpr std::uint32_t kKeyframes = 300, kTurn = 50;
  static constexpr Precision kStep{0.5 / (0.002 * 0.002), 1.0 / (0.005 * 0.005)};
  static constexpr Precision kClosure{0.5 / (0.005 * 0.005), 1.0 / (0.03 * 0.03)};
  std::mt19937 rng;
  std::map<RobotId, double> noise = {};  // odometry, actual over claimed
  double closure_noise = 1.0;
  double share_false = 0.0;

  SE3 noisy(const SE3& T, const Precision& claimed, double factor) {
    Vector6 xi = factor * random_vector<6>(rng);
    xi.head<3>() *= std::sqrt(0.5 / claimed.kappa);
    xi.tail<3>() *= std::sqrt(1.0 / claimed.tau);
    return T * se3_exp(xi);
  }
  static SE3 truth(RobotId robot, std::uint32_t k) {
    const double angle = 2.0 * 3.14159265358979 * (k + 7.0 * robot) / kTurn;
    return make_pose(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                     {8.0 * std::cos(angle), 8.0 * std::sin(angle), 0.02 * k + robot});
  }
  PairVote meet(RobotId a, RobotId b, const std::map<KeyframeId, SE3>& poses) {
    std::uniform_int_distribution<std::uint32_t> any(0, kKeyframes - 1), turn(0, 5);
    std::bernoulli_distribution is_false(share_false);
    std::vector<PoseEdge> closures;
    for (int k = 0; k < 25; ++k) {
      const std::uint32_t i = any(rng), j = (i + kTurn * turn(rng) + any(rng) % 5) % kKeyframes;
      SE3 T = noisy(truth(a, i).inverse() * truth(b, j), kClosure, closure_noise);
      if (is_false(rng)) T = random_pose(rng, 10.0);
      closures.push_back({{a, i}, {b, j}, T, kClosure});
    }
    std::map<RobotId, Precision> step{{a, kStep}, {b, kStep}};
    const auto pose = [&](const KeyframeId& id) { return poses.at(id); };
    return {.a = a, .b = b, .odometry = odometry_evidence(closures, pose, step, 3)};
  }
  std::vector<PairVote> votes(RobotId robots) {
    std::map<KeyframeId, SE3> poses;
    for (RobotId r = 0; r < robots; ++r) {
      SE3 T = SE3::Identity();
      for (std::uint32_t k = 0; k < kKeyframes; ++k) {
        poses[{r, k}] = T;
        const double factor = noise.contains(r) ? noise.at(r) : 1.0;
        T = T * noisy(truth(r, k).inverse() * truth(r, k + 1), kStep, factor);
      }
    }
    std::vector<PairVote> votes;
    for (RobotId a = 0; a < robots; ++a)
      for (RobotId b = a + 1; b < robots; ++b) votes.push_back(meet(a, b, poses));
    return votes;
  }
};

}  // namespace

TEST_CASE("Cycles through other robots show whose odometry is noisy") {
  // In long cycles, noise of odometry looks like false closures: seeds 30 and 33.
  const auto [seed, share_false] = GENERATE(table<unsigned, double>(
      {{1, 0.0}, {2, 0.0}, {3, 0.2}, {4, 0.2}, {5, 0.2}, {30, 0.0}, {33, 0.0}}));
  const double factor = GENERATE(3.0, 5.0, 7.0, 20.0);
  CAPTURE(seed, factor, share_false);
  Helices team{.rng = std::mt19937(seed), .noise = {{1, factor}}, .share_false = share_false};
  const auto found = likely_odometry_noise(team.votes(3));
  REQUIRE(found.size() == 1);
  // Cycles share steps, so the factor is found to a level, which is a factor of 2.
  CHECK(found.at(1) > factor / 2.0);
  CHECK(found.at(1) < factor * 2.0);
}

TEST_CASE("Two noisy robots of four are found") {
  const unsigned seed = GENERATE(range(1U, 6U));
  const double factor = GENERATE(7.0, 20.0);
  CAPTURE(seed, factor);
  Helices team{.rng = std::mt19937(seed), .noise = {{0, factor}, {2, factor}}};
  const auto found = likely_odometry_noise(team.votes(4));
  CHECK(found.size() == 2);
  CHECK(found.contains(0));
  CHECK(found.contains(2));
}

TEST_CASE("Odometry that is as precise as it claims is not blamed") {
  const unsigned seed = GENERATE(range(1U, 11U));
  const double closure_noise = GENERATE(1.0, 4.0);
  const double share_false = GENERATE(0.0, 0.3, 0.8);
  CAPTURE(seed, closure_noise, share_false);
  Helices team{
      .rng = std::mt19937(seed), .closure_noise = closure_noise, .share_false = share_false};
  CHECK(likely_odometry_noise(team.votes(3)).empty());
}

TEST_CASE("If most robots seem noisy, closures may be the reason") {
  Helices team{.rng = std::mt19937(1), .noise = {{0, 7.0}, {1, 7.0}}};
  CHECK(likely_odometry_noise(team.votes(3)).empty());
}

TEST_CASE("Pairs that show noise of different sizes blame the odometry of a robot") {
  const auto vote = [](RobotId b, std::array<float, kNoiseLevels> by_level) {
    PairVote pair{.a = 0, .b = b, .odometry = {}};
    for (const float gain : by_level) {
      pair.odometry.push_back(gain);
      pair.odometry.resize(pair.odometry.size() + kNoiseLevels - 1, -100.0F);
    }
    return pair;
  };
  const PairVote strong = vote(1, {0.0F, 6.0F, 13.0F, 18.0F, 10.0F, 0.0F});
  const auto found = likely_odometry_noise(
      std::vector{strong, vote(2, {0.0F, 2.0F, 4.0F, -0.2F, -20.0F, -50.0F})});
  REQUIRE(found.contains(0));
  CHECK(found.at(0) > 4.0);
  CHECK(found.at(0) < 16.0);
  const auto with_other = [&](float half, float all) {
    return likely_odometry_noise(
        std::vector{strong, vote(2, {0.0F, 2.0F, half, all, -20.0F, -50.0F})});
  };
  CHECK(with_other(-1.0F, -3.0F).contains(0));
  CHECK(with_other(-3.0F, -6.0F).empty());  // the other pair refutes the noise
  // Weak evidence counts as well: a noisy robot would lose true closures.
  const auto weak = [&](float gain) {
    return likely_odometry_noise(std::vector{vote(1, {0.0F, gain, -9.0F, -20.0F, -40.0F, -60.0F})});
  };
  CHECK(weak(3.5F).contains(0));
  CHECK(weak(2.0F).empty());
}

TEST_CASE("The likelier of two robots is noisy if the odds leave open which one") {
  const auto of_levels = [](const std::function<double(std::size_t, std::size_t)>& log_likelihood) {
    std::vector<float> evidence;
    for (std::size_t i = 0; i < kNoiseLevels; ++i)
      for (std::size_t j = 0; j < kNoiseLevels; ++j)
        evidence.push_back(static_cast<float>(log_likelihood(i, j)));
    return evidence;
  };
  // The cycles of robots 0 and 1 need one of them at level 3.
  const auto either = of_levels([](auto i, auto j) {
    const double off = static_cast<double>(std::max(i, j)) - 3.0;
    return -4.0 * off * off - 0.1 * static_cast<double>(j) -
           3.0 * static_cast<double>(std::min(i, j));
  });
  const auto precise = of_levels([](auto i, auto j) { return -0.1 * static_cast<double>(i + j); });
  const auto found = likely_odometry_noise(std::vector<PairVote>{
      {.a = 0, .b = 1, .odometry = either}, {.a = 1, .b = 2, .odometry = precise}});
  CHECK(found.contains(0));
  CHECK(!found.contains(1));
}

TEST_CASE("Pairs with many false closures only count against noise") {
  // Robots 1 and 2 are precise. With few true places there is also little evidence against noise.
  const unsigned seed = GENERATE(range(1U, 11U));
  const double share_false = GENERATE(0.6, 0.9);
  CAPTURE(seed, share_false);
  Helices team{.rng = std::mt19937(seed), .share_false = share_false};
  const std::vector<float> evidence = team.votes(2).front().odometry;
  REQUIRE(evidence.size() == kNoiseLevels * kNoiseLevels);
  CHECK(std::ranges::max(evidence) == evidence.front());
  if (share_false == 0.6) CHECK(evidence.back() < evidence.front() - 5.0F);
}

TEST_CASE("One peer alone cannot blame the odometry of a robot") {
  Helices team{.rng = std::mt19937(1)};
  std::vector<PairVote> votes = team.votes(3);
  for (std::size_t i = 0; i < kNoiseLevels; ++i)  // robot 0 lies about robot 1
    for (std::size_t j = 0; j < kNoiseLevels; ++j)
      votes[0].odometry[kNoiseLevels * i + j] += 1e6F * static_cast<float>(j);
  CHECK(likely_odometry_noise(votes).empty());
}

}  // namespace km
