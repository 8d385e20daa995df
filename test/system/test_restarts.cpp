#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <memory>

#include "test/support/process.hpp"
#include "test/system/team_run.hpp"
#include "test/system/walk.hpp"

// A robot that is killed and restarted with its id, while the other one continues.

namespace km {
namespace {

namespace fs = std::filesystem;

bool has_keyframes(const std::string& status, std::uint32_t least) {
  const auto end = status.find(" keyframes |");
  if (end == std::string::npos) return false;
  const auto begin = status.find_last_of(' ', end - 1) + 1;
  return std::strtoul(status.c_str() + begin, nullptr, 10) >= least;
}

TEST_CASE(
    "A robot that is killed and restarted joins its team again, with its new incarnation only",
    "[system]") {
  const RobotId killed = GENERATE(RobotId{0}, RobotId{1});
  const bool is_elsewhere = killed == 0;  // the new incarnation begins at another place
  const std::uint32_t killed_at = is_elsewhere ? 62 : 54;
  CAPTURE(killed);
  const TemporaryFolder folder;
  const int domain = random_domain();
  const Walk survivor{static_cast<RobotId>(1 - killed), 0}, former{killed, 30},
      next{killed, is_elsewhere ? 75U : 30U};
  const auto start = [&](const Walk& walk, const Walk& other, std::uint32_t last,
                         const std::string& name) {
    const fs::path graph = write_walk(walk, other, last, folder.path() / (name + ".g2o"));
    return std::make_unique<Process>(
        words_of(KM_BIN_DIR "/kimera_multi_robot --robot " + std::to_string(walk.robot) +
                 " --name " + name + " --graph " + graph.string() + " --rate 20 --output " +
                 (folder.path() / name).string() + " --domain " + std::to_string(domain)));
  };
  // Measurements of the survivor with the former incarnation must not be used with the new one.
  const auto first = start(survivor, former, is_elsewhere ? killed_at / 2 : kLap, "survivor");
  const auto victim = start(former, survivor, kLap, "former");
  const auto has_walked = [&](const std::string& line) { return has_keyframes(line, killed_at); };
  REQUIRE(first->wait_until(has_walked));
  REQUIRE(victim->wait_until(has_walked));
  victim->kill(SIGKILL);
  CHECK(victim->wait() == -SIGKILL);
  const auto second = start(next, survivor, kLap, "next");
  CHECK(second->wait() == 0);
  CHECK(first->wait() == 0);

  const auto place = [&](const KeyframeId& id) {
    return (id.robot == killed ? next : survivor).place(id.index);
  };
  std::size_t closures = 0;
  for (const char* robot : {"survivor", "next"}) {
    const RunSummary summary = read_summary(folder.path() / robot / "summary.json");
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1});
    CHECK(summary.exit_reason == "all present robots have settled");
    for (const RelativePose& e : read_g2o(folder.path() / robot / "pose_graph.g2o").edges) {
      if (e.from.robot == e.to.robot) continue;
      ++closures;
      CHECK(place(e.from) == place(e.to));  // otherwise it is of the former incarnation
    }
  }
  CHECK(closures > 0);
}

}  // namespace
}  // namespace km
