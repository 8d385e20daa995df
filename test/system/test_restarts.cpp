#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>

#include "test/support/process.hpp"
#include "test/system/team_run.hpp"
#include "test/system/walk.hpp"

// A robot that is killed and restarted with its id, while the other one continues.

namespace km {
namespace {

namespace fs = std::filesystem;

struct Restart {
  RobotId robot = 0;         // the other one is 1 - robot
  bool elsewhere = false;    // the new incarnation begins at another place
  std::uint32_t killed = 0;  // once both have this many keyframes
};

struct Outcome {
  bool joint = false;         // both ended optimised together, without a time limit
  double late_s = 0.0;        // delay of the survivor's end after that of the restarted robot
  std::size_t closures = 0;   // used, between the two, by either
  std::size_t of_former = 0;  // number of these with keyframes of the former incarnation
};

bool has_keyframes(const std::string& status, std::uint32_t least) {
  const auto end = status.find(" keyframes |");
  if (end == std::string::npos) return false;
  const auto begin = status.find_last_of(' ', end - 1) + 1;
  return std::strtoul(status.c_str() + begin, nullptr, 10) >= least;
}

class Trial {
 public:
  explicit Trial(const Restart& restart)
      : restart_(restart),
        survivor_{static_cast<RobotId>(1 - restart.robot), 0},
        former_{restart.robot, 30},
        next_{restart.robot, restart.elsewhere ? 75U : 30U} {}

  Outcome run() {
    // Measurements of the survivor with the former incarnation must not be used with the new one.
    const std::uint32_t last = restart_.elsewhere ? restart_.killed / 2 : kLap;
    const auto survivor = start(survivor_, former_, last, "survivor");
    const auto victim = start(former_, survivor_, kLap, "former");
    const auto has_walked = [&](const std::string& line) {
      return has_keyframes(line, restart_.killed);
    };
    REQUIRE(survivor->wait_until(has_walked));
    REQUIRE(victim->wait_until(has_walked));
    victim->kill(SIGKILL);
    CHECK(victim->wait() == -SIGKILL);
    const auto next = start(next_, survivor_, kLap, "next");
    CHECK(next->wait() == 0);
    CHECK(survivor->wait() == 0);
    Outcome outcome{.joint = is_joint("survivor") && is_joint("next")};
    const std::chrono::duration<double> late = ended(*survivor) - ended(*next);
    outcome.late_s = late.count();
    for (const char* robot : {"survivor", "next"}) count_closures(robot, outcome);
    return outcome;
  }

 private:
  std::unique_ptr<Process> start(const Walk& walk, const Walk& other, std::uint32_t last,
                                 const std::string& name) const {
    const fs::path graph = write_walk(walk, other, last, folder_.path() / (name + ".g2o"));
    return std::make_unique<Process>(
        words_of(KM_BIN_DIR "/kimera_multi_robot --robot " + std::to_string(walk.robot) +
                 " --name " + name + " --graph " + graph.string() + " --rate 20 --output " +
                 (folder_.path() / name).string() + " --domain " + std::to_string(domain_)));
  }
  [[nodiscard]] bool is_joint(const std::string& robot) const {
    const RunSummary summary = read_summary(folder_.path() / robot / "summary.json");
    return summary.pgo.members == std::vector<RobotId>{0, 1} &&
           summary.exit_reason == "all present robots have settled";
  }
  static Process::TimePoint ended(const Process& robot) { return robot.lines().back().time; }

  void count_closures(const std::string& robot, Outcome& outcome) const {
    const auto place = [&](const KeyframeId& id) {
      return (id.robot == next_.robot ? next_ : survivor_).place(id.index);
    };
    for (const RelativePose& e : read_g2o(folder_.path() / robot / "pose_graph.g2o").edges) {
      if (e.from.robot == e.to.robot) continue;
      ++outcome.closures;
      outcome.of_former += place(e.from) != place(e.to) ? 1 : 0;
    }
  }

  const Restart restart_;
  const Walk survivor_, former_, next_;
  const int domain_ = random_domain();
  TemporaryFolder folder_;
};

// Two restarts, more with KM_RESTARTS.
TEST_CASE(
    "A robot that is killed and restarted joins its team again, with its new incarnation only",
    "[system][restarts]") {
  const char* const asked = std::getenv("KM_RESTARTS");
  const int restarts = asked == nullptr ? 2 : std::atoi(asked);
  REQUIRE(restarts > 0);
  std::printf(
      "restart  robot  place    killed_at  joint  late_s  closures  of_former_incarnation\n");
  for (int k = 0; k < restarts; ++k) {
    const Restart restart{.robot = static_cast<RobotId>((k + 1) % 2),
                          .elsewhere = (k + k / 2) % 2 == 1,
                          .killed = 30 + 8 * static_cast<std::uint32_t>((k + 3) % 7)};
    const Outcome outcome = Trial(restart).run();
    std::printf("%7d  %5d  %-7s  %9u  %-5s  %6.1f  %8zu  %14zu\n", k + 1, restart.robot,
                restart.elsewhere ? "another" : "same", restart.killed,
                outcome.joint ? "yes" : "no", outcome.late_s, outcome.closures, outcome.of_former);
    std::fflush(stdout);
    CHECK(outcome.joint);
    CHECK(outcome.closures > 0);
    CHECK(outcome.of_former == 0);
  }
}

}  // namespace
}  // namespace km
