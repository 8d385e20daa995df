#include "apps/team/closure_images.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/recordings/mcap_writer.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr ClosureImageOptions kSmall{.width_px = 16};

// Keyframe k of the robot is image k of the recording, which is 10 * (k + 1) all over.
RobotResult robot_on(const fs::path& dataset, RobotId id) {
  RobotResult robot;
  robot.plan.id = id;
  robot.plan.name = "r" + std::to_string(id);
  robot.plan.dataset = dataset;
  for (int i = 0; i < EurocFolder::kPairs; ++i)
    robot.keyframes.push_back(
        {{id, static_cast<KeyframeIndex>(i)}, EurocFolder::image_stamp(i), 1.0});
  return robot;
}

ClosureRecord closure(KeyframeId from, KeyframeId to, ClosureStage stage) {
  ClosureRecord record;
  record.id = {from, to};
  record.stage = stage;
  return record;
}

double grey_of(const std::string& jpeg, int width) {
  const cv::Mat image = decode_pixels(jpeg, DecodedPixels::kGray);
  REQUIRE(image.cols == width);
  return cv::mean(image)[0];
}

TEST_CASE("Closures that were verified are shown, others not") {
  constexpr double kJpeg = 1.5;  // tolerance in grey levels
  const EurocFolder recording;
  std::vector<RobotResult> robots{robot_on(recording.root(), 0), robot_on(recording.root(), 4)};
  robots[0].closures = {closure({0, 1}, {4, 2}, ClosureStage::kInlier),
                        closure({0, 3}, {4, 6}, ClosureStage::kVerified),
                        closure({0, 5}, {4, 7}, ClosureStage::kReceived)};
  const ClosureImages images = closure_images(robots, kSmall);
  CHECK(images.notes.empty());
  REQUIRE(images.jpegs.size() == 4);
  for (const KeyframeId id : {KeyframeId{0, 1}, {4, 2}, {0, 3}, {4, 6}})
    CHECK(grey_of(images.jpegs.at(id), 16) == Approx(10.0 * (id.index + 1)).margin(kJpeg));
}

TEST_CASE("If there are too many closures, the rejected ones come first, and a note reports it") {
  const EurocFolder recording;
  std::vector<RobotResult> robots{robot_on(recording.root(), 0), robot_on(recording.root(), 1)};
  robots[0].closures = {closure({0, 0}, {0, 1}, ClosureStage::kInlier),
                        closure({0, 2}, {1, 2}, ClosureStage::kInlier),
                        closure({0, 3}, {0, 4}, ClosureStage::kVerified)};
  // Another robot has a later stage of the same pair, which counts once.
  robots[1].closures = {closure({0, 2}, {1, 2}, ClosureStage::kVerified)};
  const ClosureImages images = closure_images(robots, {.max_closures = 2, .width_px = 16});
  REQUIRE(images.jpegs.size() == 4);
  for (const KeyframeId id : {KeyframeId{0, 3}, {0, 4}, {0, 2}, {1, 2}})
    CHECK(images.jpegs.contains(id));
  REQUIRE(images.notes.size() == 1);
  CHECK(images.notes[0] == "images are shown of 2 of 3 closures that were verified");
}

TEST_CASE("A recording that is gone is a note, a pose graph none") {
  const EurocFolder recording;
  std::vector<RobotResult> robots{robot_on(recording.root(), 0), robot_on("/no/such/place", 1),
                                  robot_on("", 2)};
  robots[0].closures = {closure({0, 1}, {1, 2}, ClosureStage::kInlier),
                        closure({0, 1}, {2, 2}, ClosureStage::kInlier)};
  const ClosureImages images = closure_images(robots, kSmall);
  CHECK(images.jpegs.size() == 1);
  REQUIRE(images.notes.size() == 1);
  CHECK_THAT(images.notes[0],
             StartsWith("r1: no images of its closures: ") && Contains("/no/such/place"));
}

TEST_CASE("A corrected camera clock is the clock of the keyframes") {
  const EurocFolder recording;
  const TemporaryFolder folder;
  const auto rig = folder.write("rig.yaml", "camera_time_offset_s: 0.05\n").string();
  std::vector<RobotResult> robots{robot_on(recording.root(), 0)};
  robots[0].plan.arguments = {"--set", "a.b=1", GENERATE(0, 1) == 0 ? "--rig=" + rig : "--rig"};
  if (robots[0].plan.arguments.back() == "--rig") robots[0].plan.arguments.push_back(rig);
  robots[0].closures = {closure({0, 1}, {0, 3}, ClosureStage::kInlier)};
  const ClosureImages images = closure_images(robots, kSmall);
  REQUIRE(images.jpegs.size() == 2);  // an image later, by the camera's clock: that before
  CHECK(grey_of(images.jpegs.at({0, 3}), 16) == Approx(30.0).margin(1.5));
}

// The left images of an EurocFolder on /left, as ROS 2 records them.
std::string bag_of_lefts() {
  McapWriter writer({});
  const auto channel =
      writer.add_channel({.topic = "/left", .message_encoding = "cdr"},
                         {.name = "sensor_msgs/msg/Image", .encoding = "ros2msg", .data = ""});
  for (int i = 0; i < EurocFolder::kPairs; ++i) {
    RosImage image;
    image.header.stamp = EurocFolder::image_stamp(i);
    image.width = 32;
    image.height = 24;
    image.encoding = "mono8";
    image.step = 32;
    image.data.assign(std::size_t{32} * 24, static_cast<std::uint8_t>(10 * (i + 1)));
    writer.add({.channel_id = channel, .log_time = image.header.stamp}, encode_ros(image));
  }
  writer.finish();
  const auto bytes = writer.take();
  return {bytes.begin(), bytes.end()};
}

TEST_CASE("Images of a bag are those of the rig's left camera") {
  const EurocFolder calibration;
  const TemporaryFolder folder;
  const auto bag = folder.write("run.mcap", bag_of_lefts());
  const auto rig = folder.write("rig.yaml",
                                "left: {topic: /left}\nright: {topic: /right}\n"
                                "imu: {topic: /imu}\ncalibration: [" +
                                    calibration.mav0().string() + "]\n");
  std::vector<RobotResult> robots{robot_on(bag, 0)};
  robots[0].closures = {closure({0, 1}, {0, 6}, ClosureStage::kInlier)};
  CHECK_THAT(closure_images(robots, kSmall).notes.at(0), Contains("no --rig"));
  robots[0].plan.arguments = {"--rig", rig.string()};
  const ClosureImages images = closure_images(robots, kSmall);
  CAPTURE(images.notes);
  REQUIRE(images.jpegs.size() == 2);
  CHECK(grey_of(images.jpegs.at({0, 6}), 16) == Approx(70.0).margin(1.5));
}

}  // namespace
}  // namespace km
