#include <catch2/catch.hpp>

#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "modules/recordings/ros_messages.hpp"
#include "test/support/corrupted_input.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Messages that another CDR library wrote, and read back (golden/make.mjs); the values stand below.
struct Golden {
  std::string type;
  Bytes bytes;
};

std::vector<Golden> goldens() {
  std::ifstream file("test/modules/recordings/golden/messages.txt");
  std::vector<Golden> all;
  std::string hex;
  for (Golden golden; file >> golden.type >> hex; all.push_back(std::move(golden)))
    for (std::size_t k = 0; k + 1 < hex.size(); k += 2)
      golden.bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(k, 2), nullptr, 16)));
  return all;
}

// The doubles of a message ascend from 0.5.
struct Doubles {
  double next = 0.5;

  void fill(auto& values) {
    for (double& value : values) value = next++;
  }
  Eigen::Vector3d vector() {
    const double x = next++, y = next++, z = next++;
    return {x, y, z};
  }
  Eigen::Quaterniond quaternion() {
    const double x = next++, y = next++, z = next++, w = next++;
    return {w, x, y, z};
  }
  RosPose pose() {
    const Eigen::Vector3d position = vector();
    return {position, quaternion()};
  }
};

RosHeader header(const std::string& frame) {
  return {1700000001123456789, frame};
}

RosCameraInfo camera() {
  Doubles doubles;
  RosCameraInfo info;
  info.header = header("left");
  info.height = 480;
  info.width = 752;
  info.distortion_model = "plumb_bob";
  info.d.resize(5);
  info.binning_x = 1;
  info.binning_y = 2;
  info.roi = {.x_offset = 3, .y_offset = 4, .height = 5, .width = 6, .do_rectify = true};
  doubles.fill(info.d);
  doubles.fill(info.k);
  doubles.fill(info.r);
  doubles.fill(info.p);
  return info;
}

RosImu imu() {
  Doubles doubles;
  RosImu imu;
  imu.header = header("imu0");
  imu.orientation = doubles.quaternion();
  doubles.fill(imu.orientation_covariance);
  imu.angular_velocity = doubles.vector();
  doubles.fill(imu.angular_velocity_covariance);
  imu.linear_acceleration = doubles.vector();
  doubles.fill(imu.linear_acceleration_covariance);
  return imu;
}

RosOdometry odometry() {
  Doubles doubles;
  RosOdometry odometry;
  odometry.header = header("odom");
  odometry.child_frame_id = "base_link";
  odometry.pose.pose = doubles.pose();
  doubles.fill(odometry.pose.covariance);
  odometry.twist.twist.linear = doubles.vector();
  odometry.twist.twist.angular = doubles.vector();
  doubles.fill(odometry.twist.covariance);
  return odometry;
}

RosPath path() {
  Doubles doubles;
  RosPath path{header("map"), {}};
  for (const char* frame : {"map", "m", ""}) path.poses.push_back({header(frame), doubles.pose()});
  return path;
}

RosOccupancyGrid occupancy() {
  return {.header = header("map"),
          .info = {.map_load_time = 1700000001123456789,
                   .resolution = 0.25F,
                   .width = 3,
                   .height = 1,
                   .origin = Doubles{}.pose()},
          .data = {255, 0, 100}};
}

RosTFMessage transforms() {
  Doubles doubles;
  RosTFMessage message;
  for (const auto& [parent, child] : {std::pair("map", "odom"), std::pair("odom", "base")}) {
    const RosPose pose = doubles.pose();
    message.transforms.push_back({header(parent), child, {pose.position, pose.orientation}});
  }
  return message;
}

RosPointCloud2 cloud() {
  RosPointCloud2 cloud;
  cloud.header = header("map");
  cloud.height = 1;
  cloud.width = 2;
  cloud.fields = {{"x", 0, kRosFloat32, 1}, {"rgb", 4, kRosFloat32, 1}};
  cloud.point_step = 8;
  cloud.row_step = 16;
  for (std::uint8_t k = 0; k < 16; ++k) cloud.data.push_back(k);
  cloud.is_dense = true;
  return cloud;
}

RosDiagnosticArray diagnostics() {
  return {header(""),
          {{1, "a: odometry", "late", "a", {{"poses", "12"}, {"", "x"}}}, {0, "b", "", "", {}}}};
}

RosMarker marker(Doubles& doubles, const std::string& name_space, std::size_t count) {
  RosMarker marker;
  marker.header = header("map");
  marker.ns = name_space;
  marker.id = -2;
  marker.type = RosMarkerType::kTriangleList;
  marker.pose = doubles.pose();
  marker.scale = doubles.vector();
  marker.color = {0.25F, 0.5F, 0.75F, 1.0F};
  marker.lifetime = {3, 4};
  marker.frame_locked = true;
  for (std::size_t k = 0; k < count; ++k) marker.points.push_back(doubles.vector());
  marker.colors.assign(count, marker.color);
  marker.text = "faces";
  return marker;
}

RosMarkerArray markers() {
  Doubles doubles;
  RosMarkerArray message;
  message.markers.push_back(marker(doubles, "kept", 0));
  message.markers.push_back(marker(doubles, "a", 2));
  return message;
}

RosImage image() {
  return {.header = header("left"),
          .height = 2,
          .width = 3,
          .encoding = "mono8",
          .is_bigendian = 0,
          .step = 3,
          .data = {1, 2, 3, 4, 5, 6}};
}

}  // namespace

TEST_CASE("Messages are to the byte those of another CDR library, in both directions",
          "[recordings]") {
  const std::vector<Golden> golden = goldens();
  REQUIRE(golden.size() == 19);
  std::size_t next = 0;
  const auto read = [&]<typename Message>(const Message&) {
    const Golden& known = golden[next++];
    CAPTURE(next, known.type);
    CHECK(known.type == Message::kType);
    const auto message = decode_ros<Message>("cdr", known.bytes);
    CAPTURE(message.refusal);
    REQUIRE(message.value);
    CHECK(encode_ros(*message.value) == known.bytes);
    for (std::size_t size = 0; size < known.bytes.size(); ++size)
      CHECK(decode_ros<Message>("cdr", std::span(known.bytes).first(size)).refusal);
    for (unsigned seed = 0; seed < corrupted_files(); ++seed) {
      const auto corrupted = decode_ros<Message>("cdr", InputCorrupter(seed)({known.bytes}));
      CHECK(corrupted.value.has_value() == (corrupted.refusal == nullptr));
    }
  };
  const auto check = [&](const auto& message) {
    CAPTURE(next);
    CHECK(encode_ros(message) == golden[next].bytes);
    read(message);
  };
  check(image());
  read(RosImage{});
  check(RosCompressedImage{header("a"), "jpeg", {1, 2, 3}});
  check(imu());
  check(camera());
  read(RosCameraInfo{});
  check(RosPoseStamped{header("map"), Doubles{}.pose()});
  check(odometry());
  check(path());
  read(RosPath{});
  check(transforms());
  read(RosTFMessage{});
  check(cloud());
  read(RosPointCloud2{});
  check(diagnostics());
  Doubles doubles;
  check(marker(doubles, "mesh", 3));
  check(markers());
  check(occupancy());
  check(RosLog{1700000001123456789, RosLogLevel::kWarn, "vio", "slow", "", "f", 7});
}

}  // namespace km
