#include <catch2/catch.hpp>

#include "apps/robot/run_summary.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/system/long_run.hpp"
#include "test/system/team_run.hpp"

// How whole programs end when what surrounds them fails.

namespace km {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> robot_on_walk(const fs::path& walk, const fs::path& output) {
  return {std::string(KM_BIN_DIR) + "/kimera_multi_robot",
          "--robot",
          "0",
          "--graph",
          walk.string(),
          "--output",
          output.string(),
          "--domain",
          std::to_string(random_domain())};
}

TEST_CASE("A robot whose output nobody reads ends on a signal with its results", "[system]") {
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "out";
  const FullPipe blocked;
  Child robot(robot_on_walk(long_walk(folder.path(), 0), output), blocked.writer());
  REQUIRE(wait_for_lines(output / "process.csv", 3));
  robot.kill(SIGTERM);
  CHECK(robot.wait() == 0);
  CHECK(fs::file_size(output / "pose_graph.g2o") > 0);
  CHECK(read_summary(output / "summary.json").exit_reason == "interrupted");
}

// A team of two robots that walk for long; results in `folder`/robot0 and robot1.
std::vector<std::string> team_on_walks(const TemporaryFolder& folder) {
  long_walk(folder.path(), 0);
  long_walk(folder.path(), 1);
  const fs::path team = folder.write("team.yaml",
                                     "robots:\n"
                                     "  - {id: 0, name: robot0, graph: walk0.g2o}\n"
                                     "  - {id: 1, name: robot1, graph: walk1.g2o}\n");
  return {std::string(KM_BIN_DIR) + "/kimera_multi_team", "--config", team.string(), "--output",
          folder.path().string()};
}

TEST_CASE("A team whose output nobody reads ends on a signal with the results of all", "[system]") {
  const TemporaryFolder folder;
  const FullPipe blocked;
  Child team(team_on_walks(folder), blocked.writer());
  for (const char* robot : {"robot0", "robot1"})
    REQUIRE(wait_for_lines(folder.path() / robot / "process.csv", 3));
  team.kill(SIGTERM);
  CHECK(team.wait() == 0);
  for (const char* robot : {"robot0", "robot1"})
    CHECK(read_summary(folder.path() / robot / "summary.json").exit_reason == "interrupted");
}

TEST_CASE("A hung-up terminal and a closed pipe end a robot in order", "[system]") {
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "out";
  std::array<int, 2> ends{};
  REQUIRE(pipe2(ends.data(), O_CLOEXEC) == 0);
  Child robot(robot_on_walk(long_walk(folder.path(), 0), output), ends[1]);
  close(ends[1]);
  close(ends[0]);  // whoever read has gone: every line it says is SIGPIPE, or an error
  REQUIRE(wait_for_lines(output / "process.csv", 10));
  robot.kill(SIGHUP);
  robot.kill(SIGHUP);  // as from the terminal and from its shell
  CHECK(robot.wait() == 0);
  CHECK(read_summary(output / "summary.json").exit_reason == "interrupted");
}

TEST_CASE("Robots whose team is killed end in order with their results", "[system]") {
  const TemporaryFolder folder;
  const int quiet = open("/dev/null", O_WRONLY | O_CLOEXEC);
  {
    Child team(team_on_walks(folder), quiet);
    for (const char* robot : {"robot0", "robot1"})
      REQUIRE(wait_for_lines(folder.path() / robot / "process.csv", 3));
    team.kill(SIGKILL);
    CHECK(team.wait() == -SIGKILL);
  }
  close(quiet);
  for (const char* robot : {"robot0", "robot1"}) {
    CAPTURE(robot);
    const fs::path summary = folder.path() / robot / "summary.json";
    REQUIRE(wait_for_lines(summary, 1));
    CHECK(read_summary(summary).exit_reason == "interrupted");
  }
}

}  // namespace
}  // namespace km
