#include <catch2/catch.hpp>
#include <set>
#include <string>
#include <vector>

#include "modules/core/pose_changes.hpp"
#include "test/support/process.hpp"
#include "test/system/audience.hpp"
#include "test/system/team_run.hpp"

// Robots and a viewer, over the network.

namespace km {
namespace {

namespace fs = std::filesystem;

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

TEST_CASE("A viewer of a team knows how it ends, and changes nothing", "[system][view]") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  const Walk a{0, 0}, b{1, 40};
  Process first(robot_on(a, b, folder.path(), domain));
  Process second(robot_on(b, a, folder.path(), domain));
  CHECK(first.wait() == 0);
  CHECK(second.wait() == 0);
  const auto& known = audience.finish();
  REQUIRE(known.size() == 2);
  for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
    CAPTURE(robot);
    const fs::path results = folder.path() / robot_name(robot);
    check_knowledge(known.at(robot), results);
    const RunSummary summary = read_summary(results / "summary.json");
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1});
    CHECK(summary.exit_reason == "all present robots have settled");
  }
  CHECK(audience.refused() == 0);
}

TEST_CASE("A robot that is not to be watched sends viewers nothing", "[system][view]") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  std::vector<std::string> command = robot_on({0, 0}, {1, 40}, folder.path(), domain);
  std::erase(command, "--view");
  Process robot(command);
  CHECK(robot.wait() == 0);
  CHECK(audience.finish().empty());
}

TEST_CASE("If the team has keys, viewers receive nothing unless this is enabled",
          "[system][view]") {
  const bool in_clear = GENERATE(false, true);
  CAPTURE(in_clear);
  const TemporaryFolder folder;
  const int domain = random_domain();
  const std::string keys = (folder.path() / "keys").string();
  REQUIRE(
      run_command(KM_BIN_DIR "/kimera_multi_keys make " + keys + " --robots robot0:0").exit_code ==
      0);
  Audience audience(domain);
  std::string command;
  for (const std::string& word : robot_on({0, 0}, {1, 40}, folder.path(), domain))
    command += word + ' ';
  command += "--security " + keys + "/robot0" + (in_clear ? " --set view.in_clear=true" : "");
  const CommandResult robot = run_command(command);
  CAPTURE(robot.output);
  CHECK(robot.exit_code == 0);
  CHECK(audience.finish().empty() == !in_clear);
  CHECK((robot.output.find("view.in_clear") == std::string::npos) == in_clear);
}

}  // namespace
}  // namespace km
