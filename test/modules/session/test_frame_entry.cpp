#include "modules/core/geometry/lie.hpp"
#include "modules/robust/lone_solution.hpp"
#include "modules/session/frame_entry.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Robot 1 on a random path with exact edges, and poses that drift from it.
struct Drifted {
  static constexpr std::uint32_t kKeyframes = 30;

  std::vector<SE3> truth, poses;
  std::vector<PoseEdge> own;

  explicit Drifted(unsigned seed) {
    std::mt19937 rng(seed);
    truth.push_back(random_pose(rng));
    poses = truth;
    for (std::uint32_t k = 0; k + 1 < kKeyframes; ++k) {
      const SE3 step = random_pose(rng, 1.0);
      truth.push_back(truth.back() * step);
      poses.push_back(poses.back() * step * se3_exp(0.02 * random_vector<6>(rng)));
      own.push_back({{1, k}, {1, k + 1}, step, {100.0, 10.0}});
    }
  }
  [[nodiscard]] bool equals_truth(const std::vector<SE3>& estimate) const {
    for (std::size_t k = 0; k < truth.size(); ++k)
      if (!estimate[k].isApprox(truth[k], 1e-6)) return false;
    return true;
  }
};

}  // namespace

TEST_CASE("a drifted trajectory is deformed to the poses of other robots") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const Drifted robot(seed);
  std::mt19937 rng(seed + 10);
  std::map<KeyframeId, SE3> received;
  std::vector<PoseEdge> closures;
  for (const std::uint32_t k : {0U, 14U, 29U}) {
    const KeyframeId other{0, k};
    received[other] = robot.truth[k] * random_pose(rng, 1.0);
    const SE3 T_own_other = robot.truth[k].inverse() * received[other];
    if (k == 14U)  // measured from the other robot
      closures.push_back({other, {1, k}, T_own_other.inverse(), {100.0, 10.0}});
    else
      closures.push_back({{1, k}, other, T_own_other, {100.0, 10.0}});
  }
  // Its other robot has not sent this pose.
  closures.push_back({{1, 3}, {2, 0}, random_pose(rng), {100.0, 10.0}});
  CHECK_FALSE(robot.equals_truth(robot.poses));
  CHECK(robot.equals_truth(deformed_to_received(robot.poses, 1, robot.own, closures, received)));
}

TEST_CASE("the chordal initialisation replaces poses of a higher cost only") {
  const Drifted robot(4);
  CHECK(robot.equals_truth(better_of_chordal(robot.poses, robot.own)));
  const std::vector<SE3> kept = better_of_chordal(robot.truth, robot.own);
  for (std::size_t k = 0; k < kept.size(); ++k) CHECK(kept[k].isApprox(robot.truth[k], 1e-9));
}

TEST_CASE("a robot alone reports whether its rounds suffice") {
  Drifted robot(5);
  robot.own.push_back({{1, 2}, {1, 27}, robot.truth[2].inverse() * robot.truth[27], {100.0, 10.0}});
  const SessionGraph graph{.self = 1, .start = robot.poses, .own = robot.own};
  CHECK(solve_alone(graph, {.robust = false}).converged);
  CHECK_FALSE(solve_alone(graph, {.max_rounds = 2, .robust = false}).converged);
}

}  // namespace km
