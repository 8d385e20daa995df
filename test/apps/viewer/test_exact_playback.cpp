#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "apps/viewer/run_playback.hpp"
#include "modules/core/pose_changes.hpp"
#include "test/support/process.hpp"
#include "test/system/audience.hpp"

// A viewer of a running team, compared with the results and the playback of its run.

namespace km {
namespace {

namespace fs = std::filesystem;

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
    next = std::find_if(next, played.end(), [&](const RobotSample& one) {
      return encode_view(one) == encode_view(state);
    });
    REQUIRE(next != played.end());
    ++next;
  }
  CHECK(live.size() > 5);
  CHECK(next == played.end());
}

// The viewer's state equals the results that the robot has written.
void check_knowledge(const Watcher& known, const fs::path& results) {
  const G2oGraph graph = read_g2o(results / "pose_graph.g2o");
  CHECK(known.odometry.size() == graph.vertices.size());
  REQUIRE(known.optimized.size() == graph.vertices.size());
  for (const G2oVertex& vertex : graph.vertices) {
    CAPTURE(to_string(vertex.id));
    const auto& sent = known.optimized.at(vertex.id.index);
    CHECK(sent.anchor == 0);
    CHECK((sent.T.translation() - vertex.T_world_kf.translation()).norm() <
          StatedPoses::kMaxShift_m + 1e-4);
  }
  std::set<ClosureId> edges, kept;
  for (const RelativePose& edge : graph.edges)
    if (edge.from.robot != edge.to.robot) edges.insert(closure_id(edge.from, edge.to));
  for (const auto& [id, closure] : known.closures)
    if (closure.verdict == ClosureStatus::kKept) kept.insert(id);
  CHECK(edges.size() > 10);
  CHECK(kept == edges);
  REQUIRE_FALSE(known.states.empty());
  CHECK(known.states.back().phase == "leaving");
  CHECK(known.states.back().keyframes == graph.vertices.size());
}

TEST_CASE("A viewer of a running team and the playback of its run show its results",
          "[viewer][slow]") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  run_two_robots(folder.path(), domain);
  const auto& live = audience.finish();
  CHECK(audience.refused() == 0);
  const RunPlayback run = read_run(folder.path(), 0);
  CHECK(run.notes.empty());
  std::map<RobotId, Watcher> played;
  for (const ViewUpdate& update : run.updates) played[update.robot].receive(update.content);
  REQUIRE(live.size() == 2);
  REQUIRE(played.size() == 2);
  for (const auto& [robot, watcher] : live) {
    CAPTURE(robot);
    const fs::path results = folder.path() / robot_name(robot);
    check_knowledge(watcher, results);
    const RunSummary summary = read_summary(results / "summary.json");  // watching changes nothing
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1});
    CHECK(summary.exit_reason == "all present robots have settled");
    check_states(watcher.states, played[robot].states);
    check_same(watcher.odometry, played[robot].odometry);
    check_same(watcher.optimized, played[robot].optimized);
    CHECK(watcher.closures == played[robot].closures);
  }
}

}  // namespace
}  // namespace km
