#include "modules/core/geometry/lie.hpp"
#include "modules/robust/lone_solution.hpp"
#include "modules/robust/robust_schedule.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr std::uint32_t kLap = 20, kPoses = 3 * kLap;
constexpr double kStepNoise = 0.02, kClosureNoise = 0.01;  // [rad], [m]

Precision precision_of(double sigma) {
  return {0.5 / (sigma * sigma), 1.0 / (sigma * sigma)};
}

PoseEdge measured(const KeyframeId& from, const KeyframeId& to, const SE3& T, double sigma,
                  std::mt19937& rng) {
  return {from, to, T * se3_exp(sigma * random_vector<6>(rng)), precision_of(sigma)};
}

// Robot 1 drives three laps around a circle of 10 m. From the second lap on, each keyframe is
// joined to the one a lap before. `start` is odometry.
struct Laps {
  std::vector<SE3> truth;
  SessionGraph graph{.self = 1};
  std::set<ClosureId> true_closures, false_closures;

  explicit Laps(unsigned seed, const std::vector<std::uint32_t>& false_at = {9U}) {
    std::mt19937 rng(seed);
    for (std::uint32_t k = 0; k < kPoses; ++k) {
      SE3 T = SE3::Identity();
      T.rotate(Eigen::AngleAxisd(2.0 * M_PI * k / kLap, Eigen::Vector3d::UnitZ()));
      T.translate(Eigen::Vector3d(10.0, 0.0, 0.0));
      truth.push_back(T);
    }
    graph.start = {truth.front()};
    for (std::uint32_t k = 0; k + 1 < kPoses; ++k) {
      graph.own.push_back(measured({1, k}, {1, k + 1}, between(k, k + 1), kStepNoise, rng));
      graph.start.push_back(graph.start.back() * graph.own.back().T_from_to);
    }
    graph.odometry = graph.own.size();
    graph.step_precision[1] = precision_of(kStepNoise);
    for (std::uint32_t k = 0; k + kLap < kPoses; ++k) {
      graph.own.push_back(
          measured({1, k}, {1, k + kLap}, between(k, k + kLap), kClosureNoise, rng));
      true_closures.insert(graph.own.back().id());
    }
    for (const std::uint32_t k : false_at) {
      const SE3 wrong = between(k, k + 7) * random_pose(rng, 3.0);
      graph.own.push_back({{1, k}, {1, k + 7}, wrong, precision_of(kClosureNoise)});
      false_closures.insert(graph.own.back().id());
    }
  }

  [[nodiscard]] SE3 between(std::uint32_t from, std::uint32_t to) const {
    return truth[from].inverse() * truth[to];
  }
};

// Cost of the edges that are not false.
double true_cost(const Laps& laps, const std::vector<SE3>& poses) {
  double cost = 0.0;
  for (const PoseEdge& e : laps.graph.own) {
    if (laps.false_closures.contains(e.id())) continue;
    const double r = residual_of(e, poses[e.from.index], poses[e.to.index]);
    cost += r * r;
  }
  return cost;
}

}  // namespace

TEST_CASE("a robot with many new false closures does not move") {
  Laps laps(1, {3U, 9U, 31U});
  const std::vector<SE3> relaxed = relaxed_start(laps.graph, {});
  for (std::size_t k = 0; k < relaxed.size(); ++k)
    CHECK(relaxed[k].isApprox(laps.graph.start[k], 0.0));
  for (const ClosureId& id : laps.false_closures) laps.graph.decided[id] = false;
  CHECK(true_cost(laps, relaxed_start(laps.graph, {})) < 0.1 * true_cost(laps, relaxed));
}

TEST_CASE("a relaxed start is the optimum of the true own edges") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  Laps laps(seed);
  const std::vector<SE3> relaxed = relaxed_start(laps.graph, {});
  std::erase_if(laps.graph.own,
                [&](const PoseEdge& e) { return laps.false_closures.contains(e.id()); });
  const LoneSolution optimum = solve_alone(laps.graph, {.robust = false});
  REQUIRE(optimum.converged);
  CHECK(true_cost(laps, relaxed) <= true_cost(laps, optimum.poses) * (1.0 + 1e-6));
  CHECK(true_cost(laps, laps.graph.start) > 10.0 * true_cost(laps, relaxed));
}

TEST_CASE("the hypothesis that nothing is false holds only if it is true") {
  const unsigned seed = GENERATE(range(1U, 11U));
  CAPTURE(seed);
  const Laps laps(seed, {});
  const auto solution = solution_if_all_true(laps.graph, {});
  REQUIRE(solution);
  const LoneSolution optimum = solve_alone(laps.graph, {.robust = false});
  CHECK(true_cost(laps, *solution) <= true_cost(laps, optimum.poses) * (1.0 + 1e-6));
  CHECK_FALSE(solution_if_all_true(Laps(seed, {9U}).graph, {}));
}

TEST_CASE("a start without closures, or that cannot be solved, stays") {
  Laps laps(1);
  SECTION("no closures") {
    laps.graph.own.resize(laps.graph.odometry);
  }
  SECTION("an edge without precision") {
    laps.graph.own.back().precision = {0.0, 0.0};
  }
  const std::vector<SE3> relaxed = relaxed_start(laps.graph, {});
  REQUIRE(relaxed.size() == laps.graph.start.size());
  for (std::size_t k = 0; k < relaxed.size(); ++k)
    CHECK(relaxed[k].isApprox(laps.graph.start[k], 0.0));
}

TEST_CASE("a relaxed start stays where closures to held poses hold it") {
  Laps laps(4);
  const SE3 T_new_old(Eigen::Translation3d(2.0, -1.0, 0.5));
  for (const std::uint32_t k : {0U, 20U, 45U, 59U}) {
    const KeyframeId other{0, k};
    laps.graph.public_poses[other] = T_new_old * laps.truth[k];
    laps.graph.to_absent.push_back({{1, k}, other, SE3::Identity(), precision_of(kClosureNoise)});
  }
  const std::vector<SE3> relaxed = relaxed_start(laps.graph, {});
  for (const std::uint32_t k : {0U, 20U, 45U, 59U})
    CHECK((relaxed[k].translation() - (T_new_old * laps.truth[k]).translation()).norm() < 0.1);
}

}  // namespace km
