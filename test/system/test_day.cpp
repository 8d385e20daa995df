#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "modules/core/text_rows.hpp"
#include "test/support/network.hpp"
#include "test/support/process.hpp"
#include "test/system/laps.hpp"
#include "test/system/team_run.hpp"

// A team that is restarted, moved and cut off, as on an ordinary day.

namespace km {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kOfDay = 3;

// Robots with keys on live topics of ROS 2. Robot k is on host k + 1 with its drivers.
class LiveTeam {
 public:
  LiveTeam(double seconds, const TemporaryFolder& folder)
      : folder_(folder), network_(kOfDay), domain_(random_domain()), robots_(kOfDay) {
    const CommandResult made = run_command(KM_BIN_DIR "/kimera_multi_keys make " + keys().string() +
                                           " --robots robot0:0,robot1:1,robot2:2");
    REQUIRE(made.exit_code == 0);
    for (int robot = 0; robot < kOfDay; ++robot) {
      start(robot, "--output");
      drivers_.push_back(std::make_unique<Process>(
          words_of(KM_BIN_DIR "/kimera_multi_publish " + recording(robot).string() +
                   " --interface lo --wait 1 --to " + std::to_string(seconds)),
          network_.host(robot + 1)));
    }
  }

  [[nodiscard]] fs::path output(int robot) const { return folder_.path() / robot_name(robot); }
  [[nodiscard]] fs::path recording(int robot) const {
    return folder_.path() / "world" / robot_name(robot);
  }
  VirtualNetwork& network() { return network_; }

  // Kills the robot and resumes its run.
  void restart(int robot) {
    robots_[static_cast<std::size_t>(robot)]->kill(SIGKILL);
    robots_[static_cast<std::size_t>(robot)]->wait();
    start(robot, "--resume");
  }

  void wait_for_drivers() {
    for (const auto& driver : drivers_) CHECK(driver->wait() == 0);
  }

  // Waits until the newest status line of every robot says that it optimises with all others;
  // otherwise prints these lines.
  bool is_joint() {
    const auto status_of = [](const Process& robot) -> std::string {
      const auto lines = robot.lines();
      const auto newest = std::find_if(lines.rbegin(), lines.rend(), [](const TimedLine& line) {
        return line.text.find("| pgo: ") != std::string::npos;
      });
      return newest == lines.rend() ? "no status" : newest->text;
    };
    const auto is_with_all = [&](const auto& robot) {
      return status_of(*robot).find(", with 2") != std::string::npos;
    };
    const auto end = Clock::now() + kPatience;
    while (Clock::now() < end) {
      if (std::ranges::all_of(robots_, is_with_all)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    for (const auto& robot : robots_) std::cout << status_of(*robot) << '\n';
    return false;
  }

  void end() {
    for (const auto& robot : robots_) robot->kill(SIGTERM);
    for (const auto& robot : robots_) CHECK(robot->wait() == 0);
  }

 private:
  [[nodiscard]] fs::path keys() const { return folder_.path() / "keys"; }

  void start(int robot, const std::string& output_option) {
    const std::string name = robot_name(robot);
    const fs::path rig = folder_.write(
        name + ".yaml",
        "left: {topic: /cam0/image_raw}\nright: {topic: /cam1/image_raw}\nimu: {topic: /imu0}\n"
        "calibration: " +
            recording(robot).string() + "\n");
    robots_[static_cast<std::size_t>(robot)] = std::make_unique<Process>(
        logged(words_of(
            KM_BIN_DIR "/kimera_multi_robot --config config/datasets/euroc.yaml --robot " +
            std::to_string(robot) + " --name " + name + " --security " + (keys() / name).string() +
            " --live " + rig.string() + " --set ros.interface=lo --interface eth0 --domain " +
            std::to_string(domain_) + ' ' + output_option + ' ' + output(robot).string())),
        network_.host(robot + 1));
  }

  const TemporaryFolder& folder_;
  VirtualNetwork network_;
  int domain_;
  std::vector<std::unique_ptr<Process>> robots_;
  std::vector<std::unique_ptr<Process>> drivers_;
};

TEST_CASE("A team of live robots survives its day", "[system][day]") {
  const char* const wanted = std::getenv("KM_DAY_SECONDS");
  if (wanted == nullptr || !fs::exists(KM_BIN_DIR "/kimera_multi_simulate") ||
      !VirtualNetwork::available()) {
    std::cout << "SKIPPED: takes half an hour and the simulator, see test/endure day\n";
    return;
  }
  const double seconds = std::atof(wanted);
  const TemporaryFolder folder;
  make_laps(kOfDay, seconds, folder);
  LiveTeam team(seconds, folder);
  const auto start = Clock::now();
  const auto sleep_until = [&](double share) {
    std::this_thread::sleep_until(start + std::chrono::duration<double>(share * seconds));
  };
  for (int robot = 0; robot < kOfDay; ++robot) {
    sleep_until(0.15 * (robot + 1));
    team.restart(robot);
  }
  sleep_until(0.6);
  team.network().set_address(2, "");
  team.network().set_address(2, "10.77.0.102/24");
  sleep_until(0.7);
  team.network().set_link(3, false);
  sleep_until(0.7 + 120.0 / 1800.0);
  team.network().set_link(3, true);
  team.wait_for_drivers();
  CHECK(team.is_joint());
  team.end();

  std::string estimates, truths;
  for (int robot = 0; robot < kOfDay; ++robot) {
    CAPTURE(robot);
    const RunSummary summary = read_summary(team.output(robot) / "summary.json");
    const double growth = summary.process.memory_growth_bytes_per_minute.value_or(0.0);
    std::cout << robot_name(robot) << ": " << summary.frames << " images, " << summary.keyframes
              << " keyframes, " << growth / 1e6 << " MB a minute";
    for (const auto& [fault, count] : summary.sensor_faults)
      std::cout << ", " << count << ' ' << fault;
    std::cout << '\n';
    CHECK(growth < 1e6);
    const fs::path truth = folder.path() / ("whole_truth" + std::to_string(robot) + ".tum");
    write_truth(robot, seconds, 100, truth);
    truths += ' ' + truth.string();
    estimates += ' ' + (team.output(robot) / "optimized.tum").string();
  }
  const CommandResult error =
      run_command(KM_BIN_DIR "/kimera_multi_evaluate trajectory --truth" + truths + " --estimate" +
                  estimates + " --json " + (folder.path() / "error.json").string());
  CAPTURE(error.output);
  REQUIRE(error.exit_code == 0);
  std::cout << error.output;
  constexpr double kLargest_m = 0.05;
  CHECK(read_json(folder.path() / "error.json")["joint"]["position_m"]["rmse"].get<double>() <
        kLargest_m);
}

}  // namespace
}  // namespace km
