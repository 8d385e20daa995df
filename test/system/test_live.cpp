#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "runtime/ros/ros_publisher.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/live_run.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

// A recorded run's poses up to the n-th.
std::string first_lines(const fs::path& file, int count) {
  std::ifstream stream(file);
  std::string lines;
  std::string line;
  for (int k = 0; k < count && std::getline(stream, line); ++k) lines += line + '\n';
  return lines;
}

std::vector<std::string> robot_command(const fs::path& output, const std::string& input) {
  return words_of(euroc_robot(0, "--serve-limit 0 --output " + output.string() + ' ' + input));
}

// A robot on the live topics that a rig file names, from a driver in this domain.
std::vector<std::string> live_command(const TemporaryFolder& folder, const std::string& rig,
                                      int domain, const std::string& options = {}) {
  return robot_command(folder.path() / "live", "--live " + folder.write("rig.yaml", rig).string() +
                                                   " --set ros.domain=" + std::to_string(domain) +
                                                   " --set ros.interface=lo " + options);
}

constexpr int kPoses = 100;

// The stamps of poses.
std::vector<std::string> stamps_of(const std::string& poses) {
  std::istringstream lines(poses);
  std::vector<std::string> stamps;
  for (std::string line; std::getline(lines, line);)
    stamps.push_back(line.substr(0, line.find(' ')));
  return stamps;
}

// Poses of a robot on live topics that are played at `rate`; nullopt if it reports lost messages. A
// robot's sensors are best effort, and a busy host loses some.
std::optional<std::string> live_poses(const fs::path& dataset, double rate) {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Process robot(live_command(folder, euroc_rig(dataset), domain, "--set sensors.max_lag_s=30"));
  Process driver(driver_command(dataset, domain, "--rate " + std::to_string(rate)));
  REQUIRE(robot.wait_until(is_beyond(0.0, kPoses)).has_value());
  driver.kill(SIGINT);
  CHECK(driver.wait() == 0);
  robot.kill(SIGINT);
  CHECK(robot.wait() == 0);
  const RunSummary summary = read_summary(folder.path() / "live/summary.json");
  if (summary.sensor_faults.contains("messages lost on the way")) return std::nullopt;
  return first_lines(folder.path() / "live/odometry.tum", kPoses);
}

}  // namespace

TEST_CASE("On live topics of ROS 2 odometry is that of the recording they are played from") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  Process replay(robot_command(folder.path() / "folder",
                               "--dataset " + dataset->string() + " --to 6 --rate max"));
  CHECK(replay.wait() == 0);
  const std::string expected = first_lines(folder.path() / "folder/odometry.tum", kPoses);
  REQUIRE(std::ranges::count(expected, '\n') == kPoses);

  // Plays more slowly if the host is too busy, because this test does not measure the speed.
  std::optional<std::string> poses;
  for (const double rate : {0.7, 0.35, 0.17, 0.08, 0.04}) {
    poses = live_poses(*dataset, rate);
    if (poses && stamps_of(*poses) == stamps_of(expected)) break;  // it had all images
  }
  REQUIRE(poses.has_value());
  CHECK(*poses == expected);
}

TEST_CASE("Messages that a live robot has lost are counted in its summary") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const int domain = random_domain();
  Process robot(live_command(folder, euroc_rig(*dataset), domain));
  Process driver(driver_command(*dataset, domain, "--reliable --drop 0.1"));
  REQUIRE(robot.wait_until(is_beyond(0.0, 60)).has_value());
  robot.kill(SIGINT);
  CHECK(robot.wait() == 0);
  driver.kill(SIGINT);
  CHECK(driver.wait() == 0);
  const auto faults = read_summary(folder.path() / "live/summary.json").sensor_faults;
  CHECK(faults.contains("images missing between others"));
  CHECK(faults.contains("left images without a right one"));
}

namespace {

// Cameras that were calibrated without the inertial sensor: /tf_static has their mounting.
const std::string kUnplaced = R"(left: {topic: /cam0/image_raw}
right: {topic: /cam1/image_raw}
imu: {topic: /imu0}
calibration:
  cam0: {camera_model: pinhole, distortion_model: radtan, distortion_coeffs: [0, 0, 0, 0],
    intrinsics: [30, 30, 16, 12], resolution: [32, 24]}
  cam1: {camera_model: pinhole, distortion_model: radtan, distortion_coeffs: [0, 0, 0, 0],
    intrinsics: [30, 30, 16, 12], resolution: [32, 24],
    T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
)";

bool waits_for_calibration(const std::string& line) {
  return line.find("waiting for messages with the calibration") != line.npos;
}

}  // namespace

TEST_CASE("A robot that waits for its calibration ends at once on a signal") {
  const TemporaryFolder folder;
  Process robot(logged(live_command(folder, kUnplaced, random_domain())));
  REQUIRE(robot.wait_until(waits_for_calibration));
  robot.kill(GENERATE(SIGINT, SIGTERM));
  CHECK(robot.wait() == 0);  // 1 once its patience is over
}

TEST_CASE("A robot reads all topics of its sensors while it waits for its calibration") {
  const EurocFolder recording;
  const TemporaryFolder folder;
  const int domain = random_domain();
  Process robot(logged(live_command(folder, kUnplaced, domain)));
  const auto network =
      std::make_shared<const RosNetwork>(RosConfig{.domain = domain, .interface = "lo"});
  const RosPublisher description(network, "/tf_static", RosTFMessage::kType, RosQos::kLatched, 1);
  description.publish(encode_ros(RosTFMessage{{{{0, "imu0"}, "cam0", {}}}}));
  // Playing begins when every topic has a reader, so that the frames of the samples are received.
  Process driver(driver_command(recording.root(), domain, "--reliable"));
  const auto is_complete = [](const std::string& line) {
    return line.find("domain ") != line.npos;
  };
  CHECK(robot.wait_until(is_complete));
  CHECK(driver.wait() == 0);
  robot.kill(SIGINT);
  const int exit_code = robot.wait();
  // Messages before the calibration is complete are skipped.
  const bool has_poses = fs::file_size(folder.path() / "live/odometry.tum") > 0;
  CHECK(exit_code == (has_poses ? 0 : 1));
}

TEST_CASE("A live robot refuses depth that its driver has not aligned with colour") {
  const EurocFolder recording;  // only its calibration is used
  const TemporaryFolder folder;
  const int domain = random_domain();
  Process robot(logged(live_command(folder,
                                    "left: {topic: /color}\ndepth: {topic: /depth}\n"
                                    "imu: {topic: /imu0}\ncalibration: " +
                                        recording.root().string() + "\n",
                                    domain)));
  const auto network =
      std::make_shared<const RosNetwork>(RosConfig{.domain = domain, .interface = "lo"});
  const RosPublisher color(network, "/color", RosImage::kType, RosQos::kReliable, 1);
  const RosPublisher depth(network, "/depth", RosImage::kType, RosQos::kReliable, 1);
  RosImage image;
  image.height = 24;
  image.width = image.step = 32;
  image.encoding = "mono8";
  image.data.resize(24 * 32);
  std::optional<int> exit_code;
  while (!exit_code) {
    for (int k = 0; k < 20; ++k) {  // after ten images without CameraInfo there is none
      image.header.frame_id = "color_optical";
      color.publish(encode_ros(image));
      image.header.frame_id = "depth_optical";
      depth.publish(encode_ros(image));
    }
    exit_code = robot.wait_within(std::chrono::seconds(1));
  }
  CHECK(*exit_code == 1);
  const auto names_remedy = [](const std::string& line) {
    return line.find("/depth: depth is not aligned with the images of /color") != line.npos &&
           line.find("align_depth.enable:=true") != line.npos;
  };
  CHECK(robot.wait_until(names_remedy));
}

TEST_CASE("A live robot whose topics are silent reports where it listens, and ends as failed") {
  const auto dataset = shared_data("euroc/MH_01_easy");  // only its calibration is used
  if (!dataset) return;
  const TemporaryFolder folder;
  const int domain = random_domain();
  std::string rig = euroc_rig(*dataset);
  rig.insert(rig.find("/cam0/image_raw") + 15, "/compressed");  // its driver sends raw images only
  const auto network =
      std::make_shared<const RosNetwork>(RosConfig{.domain = domain, .interface = "lo"});
  const RosPublisher raw(network, "/cam0/image_raw", RosImage::kType, RosQos::kReliable, 1);
  Process robot(logged(live_command(folder, rig, domain)));
  const std::string place = " s on ROS domain " + std::to_string(domain) + ": no program publishes";
  const auto states = [&](const std::string& topic, const std::string& reason) {
    return robot.wait_until([&](const std::string& line) {
      return line.find("nothing on " + topic) != line.npos && line.find(place) != line.npos &&
             line.find(reason) != line.npos;
    });
  };
  REQUIRE(states("/cam0/image_raw/compressed (sensor_msgs/CompressedImage)",
                 "but one publishes /cam0/image_raw (sensor_msgs/msg/Image)"));
  REQUIRE(states("/imu0", "--set ros.domain="));
  robot.kill(SIGINT);
  CHECK(robot.wait() == 1);
  const RunSummary summary = read_summary(folder.path() / "live/summary.json");
  CHECK_THAT(summary.exit_reason, StartsWith("no image came"));
  CHECK(std::ranges::count(summary.findings, "frames.none", &Finding::id) == 1);
}

TEST_CASE("A rig file is proposed from the topics that drivers publish now") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const int domain = random_domain();
  Process driver(driver_command(*dataset, domain, ""));
  const auto rig = folder.path() / "rig.yaml";
  Process inspect(logged(words_of(KM_BIN_DIR "/kimera_multi_robot --set ros.interface=lo --set "
                                             "ros.domain=" +
                                  std::to_string(domain) + " --inspect --live " + rig.string())));
  const int code = inspect.wait();
  for (const TimedLine& line : inspect.lines()) UNSCOPED_INFO(line.text);
  REQUIRE(code == 0);
  CHECK_FALSE(inspect.lines("/cam0/image_raw ").empty());
  const PartialRig proposal = read_rig_file(rig);
  CHECK(proposal.rig.topics.left == "/cam0/image_raw");
  CHECK(proposal.rig.topics.right == "/cam1/image_raw");
  CHECK(proposal.rig.topics.imu == "/imu0");
}

}  // namespace km
