#include <catch2/catch.hpp>
#include <map>
#include <string>

#include "apps/viewer/run_playback.hpp"
#include "test/support/process.hpp"
#include "test/system/audience.hpp"

// The playback of a run, compared with a viewer of the running team.

namespace km {
namespace {

bool is_same(const RobotSample& a, const RobotSample& b) {
  return encode_view(a) == encode_view(b);
}

void check_same(const std::map<KeyframeIndex, Watcher::Placed>& live,
                const std::map<KeyframeIndex, Watcher::Placed>& played) {
  constexpr double kRounding = 1e-5;  // float32, 20 m from the origin
  REQUIRE(live.size() == played.size());
  for (const auto& [index, placed] : live) {
    CAPTURE(index);
    CHECK(placed.anchor == played.at(index).anchor);
    CHECK((placed.T.matrix() - played.at(index).T.matrix()).norm() < kRounding);
  }
}

// The viewer has received `live` of the states of the run, in their order and up to the last one.
void check_states(const std::vector<RobotSample>& live, const std::vector<RobotSample>& played) {
  auto next = played.begin();
  for (const RobotSample& state : live) {
    next = std::find_if(next, played.end(), [&](const auto& one) { return is_same(one, state); });
    REQUIRE(next != played.end());
    ++next;
  }
  CHECK(live.size() > 5);
  CHECK(next == played.end());
}

void check_closures(const std::map<ClosureId, ViewClosure>& live,
                    const std::map<ClosureId, ViewClosure>& played) {
  std::map<ClosureStatus, int> counts;
  REQUIRE(live.size() == played.size());
  for (const auto& [id, closure] : live) {
    const ViewClosure& same = played.at(id);
    CHECK(closure.verdict == same.verdict);
    CHECK(closure.matches == same.matches);
    CHECK(closure.inliers == same.inliers);
    CHECK(closure.reason == same.reason);
    ++counts[closure.verdict];
  }
  CHECK(counts[ClosureStatus::kKept] > 10);
}

TEST_CASE("A viewer of a running team and the playback of its run show the same",
          "[viewer][slow]") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  const Walk a{0, 0}, b{1, 40};
  Process first(robot_on(a, b, folder.path(), domain));
  Process second(robot_on(b, a, folder.path(), domain));
  CHECK(first.wait() == 0);
  CHECK(second.wait() == 0);
  const auto& live = audience.finish();
  const RunPlayback run = read_run(folder.path(), 0);
  CHECK(run.notes.empty());
  std::map<RobotId, Watcher> played;
  for (const ViewUpdate& update : run.updates) played[update.robot].receive(update.content);
  REQUIRE(live.size() == 2);
  REQUIRE(played.size() == 2);
  for (const auto& [robot, watcher] : live) {
    CAPTURE(robot);
    check_states(watcher.states, played[robot].states);
    check_same(watcher.odometry, played[robot].odometry);
    check_same(watcher.optimized, played[robot].optimized);
    check_closures(watcher.closures, played[robot].closures);
  }
}

}  // namespace
}  // namespace km
