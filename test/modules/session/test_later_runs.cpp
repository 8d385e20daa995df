#include "test/modules/session/placed_run.hpp"

// A run that localises itself in the map of a former run: keyframe 0 is of the map, and the step to
// keyframe 1 is unknown.

namespace km {
namespace {

// 20 steps before the first closure have a standard deviation of 0.07 m on each axis. The noise of
// translation gives 0.01 m times the root of 20, that of rotation 0.001 m times the root of 20^3
// / 3.
constexpr double kDrift_m = 0.3;

class LaterRun : public PlacedRun {
 public:
  LaterRun(TeamNetwork& network, RobotId robot, unsigned seed)
      : PlacedRun(network, robot, seed, PgoMethod::kNewton, false) {
    constexpr std::uint64_t kMap = 7;  // all robots are in this map
    agent().begin_in_map(kMap);
    std::mt19937 map(kMap);
    const SE3 first = random_pose(map, 20.0);
    begin(first, first);
    const SE3 entry = random_pose(rng_, 100.0);
    jump(entry, random_pose(rng_, 5.0));
    walk(se3_exp(Vector6{0.01, 0.0, 0.1, 0.5, 0.1, 0.0}));
  }

  // A closure with the map, off by `error`.
  void close(KeyframeIndex to, const SE3& error = SE3::Identity()) { close(0, to, error); }
  void close(KeyframeIndex from, KeyframeIndex to, const SE3& error) {
    Closure closure;
    closure.from.id = {robot(), from};
    closure.to.id = {robot(), to};
    closure.T_from_to = truth(from).inverse() * truth(to) * error * noise(0.005, 0.02);
    closure.covariance = isotropic(0.005, 0.02);
    closures_.push_back(closure.id());
    CHECK(agent().add(closure));
    std::ranges::sort(closures_);
    CHECK(agent().add(InlierSet{robot(), robot(), ++version_, closures_}));
  }

  [[nodiscard]] bool is_located() const {
    CHECK(state().trajectory.has_value() == state().progress.located);
    return state().progress.located;
  }
  [[nodiscard]] RobotId anchor() const { return state().trajectory->anchor; }
  [[nodiscard]] SE3 random_error() { return random_pose(rng_, 30.0); }

 private:
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
  CHECK(run.error_m(1) < kDrift_m);
  for (const KeyframeIndex i : {45U, 46U, 47U, 55U, 56U, 57U}) run.close(i);
  REQUIRE(settle_again(network));
  CHECK(run.error_m(1) < kDrift_m);
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
  CHECK(run.error_m(1) < kDrift_m);
}

TEST_CASE("a robot that is located in a map brings robots that closures tie to it into the map") {
  TeamNetwork network;
  LaterRun lost(network, 4, 31), located(network, 9, 32);
  for (const KeyframeIndex i : {5U, 6U, 7U, 30U, 31U, 32U}) located.close(i);
  close(lost, located);
  REQUIRE(settle_again(network));
  for (const LaterRun* const run : {&lost, &located}) {
    REQUIRE(run->is_located());
    CHECK(run->anchor() == 9);
  }
  CHECK(located.error_m(1) < kDrift_m);
  CHECK(lost.error_m(1) < 2.0 * kDrift_m);  // its drift on top of that of the other robot
  for (const KeyframeIndex i : {20U, 21U, 22U, 50U, 51U, 52U}) lost.close(i);
  REQUIRE(settle_again(network));
  REQUIRE(lost.is_located());
  CHECK(lost.anchor() == 4);
  CHECK(lost.error_m(1) < kDrift_m);
  CHECK(located.error_m(1) < kDrift_m);
}

}  // namespace
}  // namespace km
