#include "apps/robot/inspect.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

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

TEST_CASE("A right camera that is stamped later than the left one is seen") {
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

TEST_CASE("The lists of a EuRoC folder are its topics") {
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

TEST_CASE("A EuRoC folder needs no rig file, and the message names the alternative") {
  const TemporaryFolder folder;
  folder.write("mav0/cam0/data.csv", "1000000000,a\n");
  const auto rig = folder.path() / "rig.yaml";
  CHECK_THROWS_WITH(inspect_recording(folder.path(), rig),
                    Contains("is a EuRoC folder, whose calibration is its own sensor.yaml") &&
                        Contains("--dataset " + folder.path().string()));
  CHECK_FALSE(fs::exists(rig));
}

TEST_CASE("Skipped parts of a recording are reported with their place") {
  const auto file = shared_data("ros_recordings/mcap/nav2_turtlebot.mcap");
  if (!file) return;
  const TemporaryFolder folder;
  const std::string whole = read_input_file(*file);
  const auto cut = folder.write("a.mcap", whole.substr(0, whole.size() - 100));
  const std::string text = inspect_recording(cut);
  CHECK_THAT(text,
             Contains("/odom ") && Contains("truncated parts, first: " + cut.string() + " byte "));
  CHECK(text.find("\n\n") == text.npos);  // no cameras
}

TEST_CASE("A file that is no recording is refused with its name") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(inspect_recording(folder.path()),
                    folder.path().string() +
                        ": neither .db3 or .mcap files nor a recording in the layout of EuRoC, "
                        "KITTI, TUM RGB-D or 7-Scenes");
  CHECK_THROWS_AS(inspect_recording(folder.path() / "missing.bag"), InputFileError);
}

namespace {

TopicSummary topic(const std::string& name, std::string_view type, double rate_hz,
                   const std::string& image = "") {
  TopicSummary summary{.topic = name,
                       .type = std::string(type),
                       .encoding = "ros1",
                       .has_sensor_stamps = true,
                       .is_image = !image.empty()};
  if (summary.is_image) summary.image = TopicImage{{640, 480}, image};
  for (int k = 0; k < 100; ++k) summary.stamps.push_back(nanoseconds(k / rate_hz));
  return summary;
}

}  // namespace

TEST_CASE("A rig is proposed by types, rates and names") {
  const auto image = RosImage::kType, imu = RosImu::kType;
  RigFile rig = propose_rig(
      {topic("/thermal", image, 9.0, "mono8"), topic("/cam1/image_raw", image, 20.0, "mono8"),
       topic("/cam0/image_raw", image, 20.0, "mono8"), topic("/imu0", imu, 200.0)});
  CHECK(rig.left.topic == "/cam0/image_raw");
  CHECK(rig.right.topic == "/cam1/image_raw");
  CHECK(rig.imu.topic == "/imu0");
  CHECK(rig.depth.topic.empty());

  // As a RealSense's driver names them: left and right infrared, colour, gyroscope apart.
  rig = propose_rig({topic("/camera/color/image_raw", image, 30.0, "rgb8"),
                     topic("/camera/infra1/image_rect_raw", image, 30.0, "mono8"),
                     topic("/camera/infra2/image_rect_raw", image, 30.0, "mono8"),
                     topic("/camera/gyro/sample", imu, 400.0),
                     topic("/camera/accel/sample", imu, 250.0)});
  CHECK(rig.left.topic == "/camera/infra1/image_rect_raw");
  CHECK(rig.right.topic == "/camera/infra2/image_rect_raw");
  CHECK(rig.imu.topic.empty());
  CHECK(rig.imu.gyro_topic == "/camera/gyro/sample");
  CHECK(rig.imu.accel_topic == "/camera/accel/sample");

  // As the RealSense SDK and a ZED's driver name them, in another order.
  rig = propose_rig({topic("/sensor_0/Infrared_2/image/data", image, 30.0, "8UC1"),
                     topic("/sensor_0/Infrared_1/image/data", image, 30.0, "8UC1")});
  CHECK(rig.left.topic == "/sensor_0/Infrared_1/image/data");
  rig = propose_rig({topic("/zed/left/rect/image", image, 15.0, "bgra8"),
                     topic("/zed/left/raw/image", image, 15.0, "bgra8"),
                     topic("/zed/right/raw/image", image, 15.0, "bgra8"),
                     topic("/zed/right/rect/image", image, 15.0, "bgra8")});
  CHECK(rig.left.topic == "/zed/left/rect/image");
  CHECK(rig.right.topic == "/zed/right/rect/image");

  rig = propose_rig({topic("/camera/rgb/image_color", image, 30.0, "rgb8"),
                     topic("/camera/depth/image", image, 30.0, "32FC1"), topic("/imu", imu, 100)});
  CHECK(rig.left.topic == "/camera/rgb/image_color");
  CHECK(rig.right.topic.empty());
  CHECK(rig.depth.topic == "/camera/depth/image");
}

TEST_CASE("Aligned depth is proposed, or depth is reported as not aligned") {
  const auto framed = [](const std::string& name, const std::string& encoding,
                         const std::string& frame) {
    TopicSummary summary = topic(name, RosImage::kType, 30.0, encoding);
    summary.image->frame = frame;
    return summary;
  };
  std::vector<TopicSummary> topics = {framed("/camera/depth/image_rect_raw", "16UC1", "depth"),
                                      framed("/camera/color/image_raw", "rgb8", "color"),
                                      topic("/imu", RosImu::kType, 200.0)};
  CHECK_THAT(depth_problem(topics, propose_rig(topics)),
             Contains("its frame is depth, not color") && Contains("align_depth.enable:=true"));
  topics.push_back(framed("/camera/aligned_depth_to_color/image_raw", "16UC1", "color"));
  const RigFile rig = propose_rig(topics);
  CHECK(rig.left.topic == "/camera/color/image_raw");
  CHECK(rig.depth.topic == "/camera/aligned_depth_to_color/image_raw");
  CHECK(depth_problem(topics, rig).empty());
}

TEST_CASE("Topics with the calibration of cameras are proposed if they exist") {
  const auto image = RosImage::kType;
  std::vector<TopicSummary> topics = {topic("/left/image_raw", image, 20.0, "mono8"),
                                      topic("/right/image_raw", image, 20.0, "mono8"),
                                      topic("/imu0", RosImu::kType, 200.0),
                                      topic("/left/camera_info", RosCameraInfo::kType, 20.0),
                                      topic("/right/camera_info", image, 20.0)};
  const RigFile rig = propose_rig(topics);
  CHECK(rig.left.info_topic == "/left/camera_info");
  CHECK(rig.right.info_topic.empty());
}

TEST_CASE("A rig file is written for a recording, once") {
  const auto bag = shared_data("ros_recordings/rosbag2/s3e_playground_2");
  if (!bag) return;
  const TemporaryFolder folder;
  const auto file = folder.path() / "rig.yaml";
  CHECK_THAT(inspect_recording(*bag, file), Contains("written: " + file.string()));
  const std::string text = read_input_file(file);
  CHECK_THAT(text, Contains("topic: \"/Alpha/left_camera/compressed\"") &&
                       Contains("topic: \"/Alpha/right_camera/compressed\"") &&
                       Contains("topic: \"/Alpha/imu/data\""));
  CHECK_THROWS_WITH(inspect_recording(*bag, file),
                    file.string() + ": is there already: name another file");
  // Topics have the rest of the calibration.
  const PartialRig rig = read_rig_file(file);
  CHECK(!rig.is_complete());
  CHECK(rig.info_topics[0] == "/Alpha/camera_info");
}

}  // namespace km
