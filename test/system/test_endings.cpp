#include <poll.h>
#include <sched.h>
#include <sys/mount.h>

#include "apps/robot/run_summary.hpp"
#include "test/support/process.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"
#include "test/system/long_run.hpp"
#include "test/system/team_run.hpp"

// End of whole programs when a resource around them fails.

namespace km {
namespace {

std::vector<std::string> robot_on_walk(const fs::path& walk, const fs::path& output) {
  return words_of(KM_BIN_DIR "/kimera_multi_robot --robot 0 --graph " + walk.string() +
                  " --output " + output.string() + " --domain " + std::to_string(random_domain()));
}

TEST_CASE("A robot without a reader of its output ends on a signal with its results", "[endings]") {
  const bool is_closed = GENERATE(false, true);  // a pipe that is full, or has no other end
  CAPTURE(is_closed);
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "out";
  auto pipe = std::make_unique<FullPipe>();
  Process robot(robot_on_walk(long_walk(folder.path(), 0), output), 0, pipe->writer());
  if (is_closed) pipe.reset();  // every line that the robot prints gives SIGPIPE or an error
  REQUIRE(wait_for_lines(output / "process.csv", 3));
  if (is_closed)
    for (int i = 0; i < 2; ++i) robot.kill(SIGHUP);  // as from the terminal and from its shell
  else
    robot.kill(SIGTERM);
  CHECK(robot.wait() == 0);
  CHECK(fs::file_size(output / "pose_graph.g2o") > 0);
  CHECK(read_summary(output / "summary.json").exit_reason == "interrupted");
}

// A file system of its own for this thread and its processes, that holds `size` bytes.
class SmallDisk {
 public:
  explicit SmallDisk(fs::path folder, const char* size) : folder_(std::move(folder)) {
    fs::create_directory(folder_);
    mounted_ = unshare(CLONE_NEWNS) == 0 &&
               mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               mount("tmpfs", folder_.c_str(), "tmpfs", 0, size) == 0;
    if (!mounted_) std::cout << "SKIPPED: no file system can be mounted here (run as root)\n";
  }
  ~SmallDisk() {
    if (mounted_) umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool mounted() const { return mounted_; }
  void fill() const {
    std::ofstream out(folder_ / "fill", std::ios::binary);
    const std::string block(4096, 'x');
    while (out.write(block.data(), 4096).flush()) {
    }
  }
  // Waits until no file is being written.
  [[nodiscard]] bool make_read_only() const {
    constexpr unsigned long kReadOnly = MS_REMOUNT | MS_RDONLY;
    for (int i = 0; i < 1000; ++i) {
      if (mount(nullptr, folder_.c_str(), nullptr, kReadOnly, nullptr) == 0) return true;
      poll(nullptr, 0, 5);
    }
    return false;
  }

 private:
  fs::path folder_;
  bool mounted_ = false;
};

// A robot on a walk whose output is on a small disk, and its log elsewhere.
struct RobotOnSmallDisk {
  TemporaryFolder folder;
  SmallDisk disk{folder.path() / "disk", "size=256k"};
  fs::path output = folder.path() / "disk" / "out";
  int log = open((folder.path() / "log").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  std::optional<Process> robot = {};

  ~RobotOnSmallDisk() { close(log); }

  void start() {
    robot.emplace(robot_on_walk(long_walk(folder.path(), 0), output), 0, log);
    const bool running = wait_for_lines(output / "process.csv", 3);
    INFO(folder.read("log"));
    REQUIRE(running);
  }
  [[nodiscard]] bool reports(const std::string& file, const std::string& why) const {
    const std::string line = (output / file).string() + ": cannot be written: " + why;
    return folder.read("log").find(line) != std::string::npos;
  }
};

TEST_CASE("On a full or read-only disk a robot continues, names lost results, and ends with 4",
          "[endings]") {
  const bool full = GENERATE(true, false);
  CAPTURE(full);
  RobotOnSmallDisk run;
  if (!run.disk.mounted()) return;
  run.start();
  if (full)
    run.disk.fill();
  else
    REQUIRE(run.disk.make_read_only());
  const char* const why = full ? "No space left on device" : "Read-only file system";
  REQUIRE_FALSE(run.robot->wait_within(std::chrono::seconds(3)));
  run.robot->kill(SIGTERM);
  CHECK(run.robot->wait() == 4);
  for (const char* file : {"optimized.tum", "summary.json"}) {
    CAPTURE(file);
    CHECK(fs::exists(run.output / file) == full);  // on a full disk they have reserved room
    if (!full) CHECK(run.reports(file, why));
  }
  CHECK(run.reports("run.journal", why));
  if (full) CHECK(line_count(run.output / "optimized.tum") > 2);
  for (const auto& entry : fs::directory_iterator(run.output)) {
    CHECK(entry.path().extension() != ".part");
    if (full) CHECK_THAT(entry.path().filename().string(), !StartsWith("."));
  }
}

TEST_CASE("A robot whose results folder is read-only does not start", "[endings]") {
  RobotOnSmallDisk run;
  if (!run.disk.mounted()) return;
  fs::create_directory(run.output);
  REQUIRE(run.disk.make_read_only());
  Process robot(robot_on_walk(long_walk(run.folder.path(), 0), run.output), 0, run.log);
  CHECK(robot.wait() == 1);
  CHECK_THAT(run.folder.read("log"), Contains("cannot be written to: Read-only file system"));
}

TEST_CASE(
    "A results folder that is moved during the run is continued when it is back, or made again",
    "[endings]") {
  const bool is_back = GENERATE(true, false);
  CAPTURE(is_back);
  const TemporaryFolder folder;
  const fs::path output = folder.path() / "out", moved = folder.path() / "moved";
  Process robot(logged(robot_on_walk(long_walk(folder.path(), 0), output)));
  REQUIRE(wait_for_lines(output / "process.csv", 3));
  fs::rename(output, moved);
  REQUIRE(robot.wait_until([&](const std::string& line) {
    return line.find((output / "run.journal").string() + ": cannot be written") != line.npos;
  }));
  if (is_back) fs::rename(moved, output);
  robot.kill(SIGTERM);
  CHECK(robot.wait() == (is_back ? 0 : 4));
  for (const char* file : {"odometry.tum", "optimized.tum", "pose_graph.g2o", "keyframes.csv",
                           "loop_closures.csv", "timing.csv", "config.yaml"})
    CHECK(fs::exists(output / file));
  const std::string reason = read_summary(output / "summary.json").exit_reason;
  CHECK_THAT(reason, StartsWith(is_back ? "interrupted" : "interrupted; "));
  CHECK(fs::exists(output / "run.journal") == is_back);
}

// A team of two robots that walk for long; results in `folder`/robot0 and robot1.
std::vector<std::string> team_on_walks(const TemporaryFolder& folder) {
  long_walk(folder.path(), 0);
  long_walk(folder.path(), 1);
  const fs::path team = folder.write("team.yaml",
                                     "robots:\n"
                                     "  - {id: 0, name: robot0, graph: walk0.g2o}\n"
                                     "  - {id: 1, name: robot1, graph: walk1.g2o}\n");
  return words_of(KM_BIN_DIR "/kimera_multi_team --config " + team.string() + " --output " +
                  folder.path().string());
}

TEST_CASE("A team without a reader of its output ends on a signal with the results of all",
          "[endings]") {
  const TemporaryFolder folder;
  const FullPipe blocked;
  Process team(team_on_walks(folder), 0, blocked.writer());
  for (const char* robot : {"robot0", "robot1"})
    REQUIRE(wait_for_lines(folder.path() / robot / "process.csv", 3));
  team.kill(SIGTERM);
  CHECK(team.wait() == 0);
  for (const char* robot : {"robot0", "robot1"})
    CHECK(read_summary(folder.path() / robot / "summary.json").exit_reason == "interrupted");
}

TEST_CASE("Robots whose team is killed end in order with their results", "[endings]") {
  const TemporaryFolder folder;
  const int quiet = open("/dev/null", O_WRONLY | O_CLOEXEC);
  {
    Process team(team_on_walks(folder), 0, quiet);
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
