#include "modules/core/measurement_limits.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

// A run that localises itself in the map of a former run: keyframe 0 is of the map, and the step to
// keyframe 1 is unknown.

namespace km {
namespace {

constexpr KeyframeIndex kLaterKeyframes = 60;
// 20 steps before the first closure have a standard deviation of 0.07 m on each axis. The noise of
// translation gives 0.01 m times the root of 20, that of rotation 0.001 m times the root of 20^3
// / 3.
constexpr double kDrift_m = 0.3;

class LaterRun {
 public:
  LaterRun(TeamNetwork& network, RobotId robot, unsigned seed)
      : rng_(seed),
        network_(network),
        robot_(robot),
        agent_(network.add({robot, 1}, {}, solver_choice({}))) {
    constexpr std::uint64_t kMap = 7;  // all robots are in this map
    agent_.begin_in_map(kMap);
    std::mt19937 map(kMap);
    truth_.push_back(random_pose(map, 20.0));
    add({.id = {robot_, 0}}, truth_.front(), Matrix6::Zero());
    truth_.push_back(random_pose(rng_, 100.0));
    add({.id = {robot_, 1}}, random_pose(rng_, 5.0), isotropic(2.0, kUnknownStep_m));
    for (KeyframeIndex i = 2; i < kLaterKeyframes; ++i) {
      const SE3 step = se3_exp(Vector6{0.01, 0.0, 0.1, 0.5, 0.1, 0.0});
      truth_.push_back(truth_.back() * step);
      add({.id = {robot_, i}}, step * noise(0.002, 0.01), isotropic(0.002, 0.01));
    }
  }

  // A closure with the map, off by `error`.
  void close(KeyframeIndex to, const SE3& error = SE3::Identity()) { close(0, to, error); }
  void close(KeyframeIndex from, KeyframeIndex to, const SE3& error) {
    Closure closure;
    closure.from.id = {robot_, from};
    closure.to.id = {robot_, to};
    closure.T_from_to = truth_[from].inverse() * truth_[to] * error * noise(0.005, 0.02);
    closure.covariance = isotropic(0.005, 0.02);
    closures_.push_back(closure.id());
    CHECK(agent_.add(closure));
    std::ranges::sort(closures_);
    CHECK(agent_.add(InlierSet{robot_, robot_, ++version_, closures_}));
  }

  [[nodiscard]] bool is_located() const {
    const auto& robot = network_.robots.at(robot_);
    CHECK(robot.trajectory.has_value() == robot.progress.located);
    return robot.progress.located;
  }
  // Largest distance of an optimised keyframe of this run from its true place in the map.
  [[nodiscard]] double error_m() const {
    const Trajectory& found = *network_.robots.at(robot_).trajectory;
    double largest = 0.0;
    for (KeyframeIndex i = 1; i < kLaterKeyframes; ++i)
      largest =
          std::max(largest, (found.T_world_kf[i].translation() - truth_[i].translation()).norm());
    return largest;
  }
  [[nodiscard]] RobotId anchor() const { return network_.robots.at(robot_).trajectory->anchor; }
  [[nodiscard]] const SE3& truth(KeyframeIndex i) const { return truth_[i]; }
  [[nodiscard]] TeamAgent& agent() { return agent_; }
  [[nodiscard]] SE3 random_error() { return random_pose(rng_, 30.0); }

 private:
  SE3 noise(double rotation_rad, double translation_m) {
    Vector6 xi = random_vector<6>(rng_);
    xi.head<3>() *= rotation_rad;
    xi.tail<3>() *= translation_m;
    return se3_exp(xi);
  }
  void add(KeyframeOdometry keyframe, const SE3& T_previous_kf, const Matrix6& covariance) {
    keyframe.T_previous_kf = T_previous_kf;
    keyframe.T_odom_kf = T_odom_kf_ = T_odom_kf_ * T_previous_kf;
    keyframe.covariance = covariance;
    CHECK(agent_.add(keyframe));
  }

  std::mt19937 rng_;
  TeamNetwork& network_;
  RobotId robot_;
  TeamAgent& agent_;
  std::vector<SE3> truth_;  // T_map_kf
  SE3 T_odom_kf_ = SE3::Identity();
  std::vector<ClosureId> closures_;
  std::uint32_t version_ = 0;
};

bool settle_again(TeamNetwork& network) {
  (void)network.run(1.0);  // progress is reported once per status
  return settle(network, 60.0);
}

TEST_CASE("a run is located once closures at two places tie it to the map") {
  TeamNetwork network;
  const RobotId robot = GENERATE(RobotId{4}, std::numeric_limits<RobotId>::max());
  LaterRun run(network, robot, GENERATE(1U, 2U, 3U));
  REQUIRE(settle_again(network));
  CHECK_FALSE(run.is_located());
  for (const KeyframeIndex i : {5U, 6U, 7U}) run.close(i);
  REQUIRE(settle_again(network));
  CHECK_FALSE(run.is_located());
  for (const KeyframeIndex i : {30U, 31U, 32U}) run.close(i);
  REQUIRE(settle_again(network));
  REQUIRE(run.is_located());
  CHECK(run.error_m() < kDrift_m);
  for (const KeyframeIndex i : {45U, 46U, 47U, 55U, 56U, 57U}) run.close(i);
  REQUIRE(settle_again(network));
  CHECK(run.error_m() < kDrift_m);
}

TEST_CASE("a run that never sees the map is solved by itself") {
  TeamNetwork network;
  LaterRun run(network, 4, 21);
  for (KeyframeIndex i = 1; i <= 28; ++i) run.close(i, i + 30, SE3::Identity());
  REQUIRE(settle_again(network));
  CHECK_FALSE(run.is_located());
}

TEST_CASE("a place that looks like another does not locate a run") {
  TeamNetwork network;
  LaterRun run(network, 4, GENERATE(11U, 12U, 13U, 14U, 15U, 16U));
  const SE3 error = run.random_error();
  for (const KeyframeIndex i : {3U, 4U, 5U, 6U}) run.close(i, error);
  REQUIRE(settle_again(network));
  CHECK_FALSE(run.is_located());
  for (const KeyframeIndex i : {20U, 21U, 22U, 37U, 38U, 39U, 54U, 55U, 56U}) run.close(i);
  REQUIRE(settle_again(network));
  REQUIRE(run.is_located());
  CHECK(run.error_m() < kDrift_m);
}

TEST_CASE("a robot that is located in a map brings robots that closures tie to it into the map") {
  TeamNetwork network;
  LaterRun lost(network, 4, 31), located(network, 9, 32);
  for (const KeyframeIndex i : {5U, 6U, 7U, 30U, 31U, 32U}) located.close(i);
  std::vector<ClosureId> between;
  for (const KeyframeIndex i : {10U, 11U, 12U, 40U, 41U, 42U}) {
    Closure closure;
    closure.from.id = {4, i};
    closure.to.id = {9, i};
    closure.T_from_to = lost.truth(i).inverse() * located.truth(i);
    closure.covariance = isotropic(0.005, 0.02);
    between.push_back(closure.id());
    for (LaterRun* const run : {&lost, &located}) CHECK(run->agent().add(closure));
  }
  for (LaterRun* const run : {&lost, &located})
    CHECK(run->agent().add(InlierSet{4, 9, 1, between}));
  REQUIRE(settle_again(network));
  for (const LaterRun* const run : {&lost, &located}) {
    REQUIRE(run->is_located());
    CHECK(run->anchor() == 9);
  }
  CHECK(located.error_m() < kDrift_m);
  CHECK(lost.error_m() < 2.0 * kDrift_m);  // its drift on top of that of the other robot
  for (const KeyframeIndex i : {20U, 21U, 22U, 50U, 51U, 52U}) lost.close(i);
  REQUIRE(settle_again(network));
  REQUIRE(lost.is_located());
  CHECK(lost.anchor() == 4);
  CHECK(lost.error_m() < kDrift_m);
  CHECK(located.error_m() < kDrift_m);
}

}  // namespace
}  // namespace km
