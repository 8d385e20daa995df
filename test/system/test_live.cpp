#include <catch2/catch.hpp>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// A recorded run's poses up to the n-th.
std::string first_lines(const fs::path& file, std::size_t count) {
  std::ifstream stream(file);
  std::string lines;
  std::string line;
  for (std::size_t k = 0; k < count && std::getline(stream, line); ++k) lines += line + '\n';
  return lines;
}

std::vector<std::string> robot_command(const fs::path& output,
                                       const std::vector<std::string>& input) {
  std::vector<std::string> command = {KM_BIN_DIR "/kimera_multi_robot",
                                      "--config",
                                      "config/datasets/euroc.yaml",
                                      "--robot",
                                      "0",
                                      "--serve-limit",
                                      "0",
                                      "--domain",
                                      std::to_string(random_domain()),
                                      "--output",
                                      output.string()};
  command.insert(command.end(), input.begin(), input.end());
  return command;
}

}  // namespace

TEST_CASE("On live topics of ROS 2 odometry is that of the recording they are played from",
          "[system][live]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const fs::path rig =
      folder.write("rig.yaml",
                   "left: {topic: /cam0/image_raw}\nright: {topic: /cam1/image_raw}\n"
                   "imu: {topic: /imu0}\ncalibration: " +
                       fs::absolute(*dataset).string() + "\n");
  const std::string domain = std::to_string(random_domain());
  Process robot(robot_command(
      folder.path() / "live",
      {"--live", rig.string(), "--set", "ros.domain=" + domain, "--set", "ros.interface=lo"}));
  // Reliable and slower than real time: what is asked here is not whether a busy host keeps up.
  Process driver({KM_BIN_DIR "/kimera_multi_publish", dataset->string(), "--domain", domain,
                  "--interface", "lo", "--wait", "1", "--reliable", "--rate", "0.7"});
  constexpr std::size_t kPoses = 100;
  const auto has_poses = [](const std::string& line) {  // "5.6 s, 112 images, ..."
    double seconds = 0.0;
    int images = 0;
    return std::sscanf(line.c_str(), "%lf s, %d images", &seconds, &images) == 2 &&
           images > static_cast<int>(kPoses);
  };
  REQUIRE(robot.wait_until(has_poses).has_value());
  driver.kill(SIGINT);
  CHECK(driver.wait() == 0);
  robot.kill(SIGINT);
  CHECK(robot.wait() == 0);

  Process replay(robot_command(folder.path() / "folder",
                               {"--dataset", dataset->string(), "--to", "6", "--rate", "max"}));
  CHECK(replay.wait() == 0);
  CHECK(first_lines(folder.path() / "live/odometry.tum", kPoses) ==
        first_lines(folder.path() / "folder/odometry.tum", kPoses));
}

}  // namespace km
