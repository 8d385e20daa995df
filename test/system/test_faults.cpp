#include <sys/stat.h>

#include <list>

#include "apps/robot/run_summary.hpp"
#include "test/support/demo_world.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"
#include "test/system/long_run.hpp"
#include "test/system/team_run.hpp"

// Modules that fail or hang inside a robot.

namespace km {
namespace {

// With less patience than by default, so that the tests take less time: 12 s.
constexpr const char* kLittlePatience = "run.patience=0.1";

// A robot with its log in `folder`/log.
struct FaultyRobot {
  TemporaryFolder folder;
  fs::path output = folder.path() / "out";
  int log = open((folder.path() / "log").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  int domain = random_domain();
  std::optional<Process> process = {};

  ~FaultyRobot() { close(log); }

  void start(const std::string& module, const std::string& how, const fs::path& input,
             const std::string& settings = {}) {
    process.emplace(words_of(KM_BIN_DIR "/test_faulty_robot " + module + ' ' + how + ' ' +
                             output.string() + ' ' + std::to_string(domain) + ' ' + input.string() +
                             ' ' + kLittlePatience + ' ' + settings),
                    0, log);
  }
  [[nodiscard]] std::string log_text() const { return folder.read("log"); }
};

void check_end(FaultyRobot& robot, const std::string& module, const std::string& how) {
  CAPTURE(module, how);
  const std::optional<int> exit_code = robot.process->wait_within(3 * kPatience);
  CAPTURE(robot.log_text());
  CHECK(exit_code == (how == "hang" ? 5 : 3));
  CHECK_THAT(robot.log_text(), Contains(how == "hang" ? "supervisor: " + module + " has not"
                                                      : module + " failed: injected"));
  for (const char* file : {"odometry.tum", "optimized.tum", "pose_graph.g2o", "keyframes.csv",
                           "loop_closures.csv", "optimizer.csv", "timing.csv", "process.csv"})
    CHECK(fs::is_regular_file(robot.output / file));
  const RunSummary summary = read_summary(robot.output / "summary.json");
  CHECK_THAT(summary.exit_reason, StartsWith(module + ": "));
}

// For each module a robot in which it throws and one in which it hangs. Those in which it hangs
// wait beside all others.
void check_faults(const std::vector<std::string>& modules, const fs::path& input,
                  const std::string& settings = {}) {
  std::list<FaultyRobot> waiting;
  for (const std::string& module : modules)
    waiting.emplace_back().start(module, "hang", input, settings);
  for (const std::string& module : modules) {
    FaultyRobot robot;
    robot.start(module, "throw", input, settings);
    check_end(robot, module, "throw");
  }
  auto robot = waiting.begin();
  for (const std::string& module : modules) check_end(*robot++, module, "hang");
}

TEST_CASE("A module that throws or hangs is named, and what was recorded is written", "[faults]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  check_faults({"sensors", "vio", "keyframe_features", "place_recognition", "loop_closure", "pcm",
                "journal", "pose_graph"},
               *dataset);
}

TEST_CASE("A module of the map that throws or hangs is named, and recorded results are written",
          "[faults]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  check_faults({"dense_sensing", "semantic_mapping", "mesh_deformation"}, *dataset,
               "mapping.mode=metric");
}

TEST_CASE("A disk that stands still under the map leaves the other results", "[faults]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  FaultyRobot robot;
  robot.start("none", "hang", *dataset, "mapping.mode=metric");
  REQUIRE(wait_for_lines(robot.output / "process.csv", 1));
  // The opening of a pipe without a reader never returns.
  REQUIRE(mkfifo((robot.output / "mesh.ply.part").c_str(), 0600) == 0);
  CHECK(robot.process->wait_within(3 * kPatience) == 5);
  CAPTURE(robot.log_text());
  CHECK_THAT(robot.log_text(), Contains("mesh_files has not"));
  CHECK(fs::is_regular_file(robot.output / "pose_graph.g2o"));
  CHECK_THAT(read_summary(robot.output / "summary.json").exit_reason,
             StartsWith("mesh_files: ") && Contains("1 result lost") && Contains("mesh.ply"));
}

// Hidden: for test/endure lies.
TEST_CASE("A member that sends false maps and objects costs the others little", "[.lies]") {
  const TemporaryFolder folder;
  const auto run_beside = [&](const std::string& how) {
    const std::string output = (folder.path() / how).string();
    const std::string domain = std::to_string(random_domain());
    const std::string map = " mapping.mode=semantic run.settle_s=3";
    Process member(words_of(KM_BIN_DIR "/test_faulty_robot none " + how + ' ' + output +
                            "_member " + domain + ' ' + (kDemoWorld / "robot1").string() + map));
    Process honest(words_of(KM_BIN_DIR "/kimera_multi_robot --config euroc --robot 0 --rate max "
                                       "--serve-limit 60 --dataset " +
                            (kDemoWorld / "robot0").string() + " --output " + output +
                            " --domain " + domain + " --set" + map));
    CHECK(honest.wait() == 0);
    CHECK(member.wait() == 0);
    return read_summary(output + "/summary.json");
  };
  const RunSummary usual = run_beside("hang"),
                   lied_to = run_beside("lie");  // `none hang`: no fault
  const auto print = [](const char* beside, const RunSummary& summary) {
    std::cout << beside << ": " << summary.process.cpu_s << " s of CPU, "
              << static_cast<double>(summary.process.peak_memory_bytes) / 1e6 << " MB, "
              << summary.pgo.members.size() << " robots joined\n";
  };
  print("beside a sound member", usual);
  print("beside a liar", lied_to);
  CHECK(lied_to.pgo.members.size() == 2);
  CHECK(lied_to.process.cpu_s < 2.0 * usual.process.cpu_s + 5.0);
  CHECK(lied_to.process.peak_memory_bytes < usual.process.peak_memory_bytes + 200'000'000);
}

}  // namespace
}  // namespace km
