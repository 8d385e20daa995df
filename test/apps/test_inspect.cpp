#include <catch2/catch.hpp>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "apps/robot/inspect.hpp"
#include "modules/core/input_file.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

// The words of the line of `text` that begins with `begin`.
std::vector<std::string> words_of_line(const std::string& text, const std::string& begin) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(begin)) continue;
    std::istringstream words(line);
    return {std::istream_iterator<std::string>(words), {}};
  }
  return {};
}

using Words = std::vector<std::string>;

}  // namespace

TEST_CASE("A right camera that is stamped later than the left one is seen", "[robot]") {
  const auto folder = shared_data("ros_recordings/rosbag2/s3e_playground_2");
  if (!folder) return;
  const std::string text = inspect_recording(*folder);
  CAPTURE(text);
  CHECK(words_of_line(text, "/Alpha/left_camera/compressed ") ==
        Words{"/Alpha/left_camera/compressed", "sensor_msgs/msg/CompressedImage", "2",
              "1661164286.639", "1661164286.739", "10.00", "0.100", "0.00", "0", "sensor",
              "1224x1024", "jpeg"});
  CHECK(words_of_line(text, "/Alpha/left_camera/compressed /Alpha/right_camera/compressed ") ==
        Words{"/Alpha/left_camera/compressed", "/Alpha/right_camera/compressed", "2", "0", "2.000",
              "0.000", "0", "0"});
  CHECK(words_of_line(text, "/Bob/imu/data ") == Words{"/Bob/imu/data", "sensor_msgs/msg/Imu", "0",
                                                       "-", "-", "-", "-", "-", "0", "sensor",
                                                       "-"});
  CHECK(words_of_line(text, "/Alpha/imu/data ").at(2) == "14");
}

TEST_CASE("The lists of a EuRoC folder are its topics", "[robot]") {
  const TemporaryFolder folder;
  folder.write("mav0/cam0/data.csv", "#timestamp [ns],filename\n1000000000,a\n1050000000,b\n");
  folder.write("mav0/cam1/data.csv", "#timestamp [ns],filename\n1000000000,a\n1050000000,b\n");
  folder.write("mav0/imu0/data.csv", "1000000000,0,0,0,0,0,9.8\n1005000000,0,0,0,0,0,9.8\n");
  const std::string text = inspect_recording(folder.path());
  CAPTURE(text);
  CHECK(words_of_line(text, "imu0 ") == Words{"imu0", "data.csv", "2", "1.000", "1.005", "200.00",
                                              "0.005", "0.00", "0", "sensor", "-"});
  CHECK(words_of_line(text, "cam0 cam1 ") ==
        Words{"cam0", "cam1", "2", "2", "0.000", "0.000", "0", "0"});
}

TEST_CASE("A EuRoC folder needs no rig file, and the message names the alternative", "[robot]") {
  const TemporaryFolder folder;
  folder.write("mav0/cam0/data.csv", "1000000000,a\n");
  const auto rig = folder.path() / "rig.yaml";
  CHECK_THROWS_WITH(
      inspect_recording(folder.path(), rig),
      Catch::Contains("is a EuRoC folder, whose calibration is its own sensor.yaml") &&
          Catch::Contains("--dataset " + folder.path().string()));
  CHECK_FALSE(std::filesystem::exists(rig));
}

TEST_CASE("Skipped parts of a recording are reported with their place", "[robot]") {
  const auto file = shared_data("ros_recordings/mcap/nav2_turtlebot.mcap");
  if (!file) return;
  const TemporaryFolder folder;
  const std::string whole = read_input_file(*file);
  const auto cut = folder.write("a.mcap", whole.substr(0, whole.size() - 100));
  const std::string text = inspect_recording(cut);
  CHECK_THAT(text, Catch::Contains("/odom ") &&
                       Catch::Contains("truncated parts, first: " + cut.string() + " byte "));
  CHECK(text.find("\n\n") == text.npos);  // no cameras
}

TEST_CASE("A file that is no recording is refused with its name", "[robot]") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(inspect_recording(folder.path()),
                    folder.path().string() +
                        ": neither .db3 or .mcap files nor a recording in the layout of EuRoC, "
                        "KITTI, TUM RGB-D or 7-Scenes");
  CHECK_THROWS_AS(inspect_recording(folder.path() / "missing.bag"), InputFileError);
}

}  // namespace km
