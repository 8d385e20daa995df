#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/bytes.hpp"
#include "modules/recordings/ros_camera.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/modules/sensors/listed_bag.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

// A message that another library wrote.
struct Golden {
  std::string type, encoding;
  Bytes bytes;
};

std::vector<Golden> goldens(const std::string& file_name) {
  std::ifstream file("test/modules/recordings/golden/" + file_name);
  std::vector<Golden> all;
  std::string hex;
  for (Golden golden; file >> golden.type >> golden.encoding >> hex;
       all.push_back(std::exchange(golden, {})))
    for (std::size_t k = 0; k + 1 < hex.size(); k += 2)
      golden.bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(k, 2), nullptr, 16)));
  return all;
}

// The same values as Debian's python3-genpy (1.15) writes in ROS 1 and npm's @foxglove/cdr in both
// byte orders, three for each type.
const std::vector<Golden>& samples() {
  static const std::vector<Golden> all = goldens("samples.txt");
  REQUIRE(all.size() == 9);
  return all;
}
constexpr std::size_t kImage = 0, kOdometry = 3, kTransforms = 6;

// Returns the message as read. It is refused if it is cut, and refused or read if it is corrupted;
// `refused` counts the corrupted ones that are refused.
template <typename Message>
Message read(const Golden& golden, unsigned& refused) {
  CHECK(golden.type == Message::kType);
  const auto message = decode_ros<Message>(golden.encoding, golden.bytes);
  CAPTURE(golden.type, golden.encoding, message.refusal);
  REQUIRE(message.value);
  for (std::size_t size = 0; size < golden.bytes.size(); ++size)
    CHECK(decode_ros<Message>(golden.encoding, std::span(golden.bytes).first(size)).refusal);
  for (unsigned seed = 0; seed < corrupted_files(); ++seed) {
    const auto corrupted =
        decode_ros<Message>(golden.encoding, InputCorrupter(seed)({golden.bytes}));
    CHECK(corrupted.value.has_value() == (corrupted.refusal == nullptr));
    refused += corrupted.value ? 0 : 1;
  }
  return *message.value;
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

// golden/make.mjs wrote the messages; the values stand above.
TEST_CASE("Messages are to the byte those of another CDR library, in both directions") {
  const std::vector<Golden> golden = goldens("messages.txt");
  REQUIRE(golden.size() == 19);
  std::size_t next = 0;
  unsigned refused = 0;
  const auto read_next = [&]<typename Message>(const Message&) {
    CHECK(encode_ros(read<Message>(golden[next], refused)) == golden[next].bytes);
    ++next;
  };
  const auto check = [&](const auto& message) {
    CAPTURE(next);
    CHECK(encode_ros(message) == golden[next].bytes);
    read_next(message);
  };
  check(image());
  read_next(RosImage{});
  check(RosCompressedImage{header("a"), "jpeg", {1, 2, 3}});
  check(imu());
  check(camera());
  read_next(RosCameraInfo{});
  check(RosPoseStamped{header("map"), Doubles{}.pose()});
  check(odometry());
  check(path());
  read_next(RosPath{});
  check(transforms());
  read_next(RosTFMessage{});
  check(cloud());
  read_next(RosPointCloud2{});
  check(diagnostics());
  Doubles doubles;
  check(marker(doubles, "mesh", 3));
  check(markers());
  check(occupancy());
  check(RosLog{1700000001123456789, RosLogLevel::kWarn, "vio", "slow", "", "f", 7});
}

TEST_CASE("Messages of any encoding are read equally, and refused when longer") {
  const auto check = []<typename Message>(std::size_t first, const Message&) {
    for (std::size_t k = first; k < first + 3; ++k) {
      Golden golden = samples()[k];
      unsigned refused = 0;
      const auto message = read<Message>(golden, refused);
      CHECK(encode_ros(message) == samples()[first + 1].bytes);  // little-endian
      CHECK(refused > 0);
      CHECK(refused < corrupted_files());
      golden.bytes.resize(golden.bytes.size() + 4);
      CHECK(decode_ros<Message>(golden.encoding, golden.bytes).refusal);
    }
  };
  check(kImage, RosImage{});
  check(kOdometry, RosOdometry{});
  check(kTransforms, RosTFMessage{});
}

TEST_CASE("The header is read from the beginning of any message") {
  const Golden& golden = samples()[kOdometry + GENERATE(as<std::size_t>(), 0, 1, 2)];
  const auto header = decode_ros<RosHeader>(golden.encoding, golden.bytes);
  REQUIRE(header.value);
  CHECK(header.value->stamp == 1661164286607675136);
  CHECK(header.value->frame_id == "left_cam");
  CHECK(decode_ros<RosHeader>(golden.encoding, std::span(golden.bytes).first(20)).refusal);
}

TEST_CASE("Stamps before 1970 are ROS 2's and those after 2038 ROS 1's") {
  ByteWriter out;
  out.u32(0);
  out.u32(0xffffffff);
  out.u32(5);
  out.u32(0);
  const Bytes bytes = out.release();
  CHECK(decode_ros<RosHeader>("ros1", bytes).value->stamp == 4294967295000000005);
  Bytes cdr = {0, 1, 0, 0};
  cdr.insert(cdr.end(), bytes.begin() + 4, bytes.end());
  CHECK(decode_ros<RosHeader>("cdr", cdr).value->stamp == -999999995);
  const RosPoseStamped before_1970{{-1, "odom"}, {}};
  CHECK(decode_ros<RosPoseStamped>("cdr", encode_ros(before_1970)).value->header.stamp == -1);
}

TEST_CASE("Unknown encodings, and images with fewer pixels than they state, are refused") {
  Bytes bytes = samples()[kImage].bytes;
  const std::size_t height = 4 + 8 + 4 + 8;
  REQUIRE(bytes[height] == 2);
  bytes[height] = 3;
  CHECK(decode_ros<RosImage>("ros1", bytes).refusal);
  bytes = samples()[kOdometry + 1].bytes;
  CHECK(decode_ros<RosOdometry>("json", bytes).refusal);
  for (const std::uint8_t kind :
       {std::uint8_t{2}, std::uint8_t{3}, std::uint8_t{7}}) {  // parameter lists and version 2
    bytes[1] = kind;
    CHECK(decode_ros<RosOdometry>("cdr", bytes).refusal);
  }
}

TEST_CASE("Types are known by their names in ROS 1 and 2") {
  const auto is_image = [](const std::string& type) {
    return is_of_type(BagChannel{.topic = "", .type = type, .encoding = ""}, RosImage::kType);
  };
  CHECK(is_image("sensor_msgs/Image"));
  CHECK(is_image("sensor_msgs/msg/Image"));
  CHECK(is_image("sensor_msgs::msg::dds_::Image_"));
  CHECK_FALSE(is_image("sensor_msgs::msg::dds_::CompressedImage_"));
  CHECK_FALSE(is_image("sensor_msgs/srv/Image"));
  CHECK_FALSE(is_image("sensor_msgs/CompressedImage"));
  CHECK_FALSE(is_image("sensor_msgs/msg/Images"));
  CHECK_FALSE(is_image(""));
  CHECK(is_of_type({.topic = "", .type = "tf/tfMessage", .encoding = ""}, RosTFMessage::kType));
}

namespace {

TEST_CASE("A raw image's camera is that of K and D, a rectified one's that of P") {
  const Camera camera = camera_of(camera_info("left_optical"), RosImages::kRaw);
  CHECK(camera.width == 640);
  CHECK(camera.height == 480);
  CHECK(Eigen::Vector4d(camera.fx, camera.fy, camera.cx, camera.cy) ==
        Eigen::Vector4d(458.0, 457.0, 320.5, 240.5));
  CHECK(camera.lens == Lens(LensModel::kRadialTangential, {-0.28, 0.07, 2e-4, 1e-5}));
  const Camera rectified = camera_of(camera_info("left_optical"), RosImages::kRectified);
  CHECK(Eigen::Vector4d(rectified.fx, rectified.fy, rectified.cx, rectified.cy) ==
        Eigen::Vector4d(430.0, 430.0, 318.0, 239.0));
  CHECK(rectified.lens.is_ideal());
}

TEST_CASE("ROS's models of distortion are lenses") {
  RosCameraInfo info = camera_info("left_optical");
  const auto lens = [&] { return camera_of(info, RosImages::kRaw).lens; };
  info.d = {-0.28, 0.07, 2e-4, 1e-5, 0.03};
  CHECK(lens() == Lens(LensModel::kRadialTangential, info.d));
  info.d = {0, 0, 0, 0, 0};  // as of rectified images
  CHECK(lens().is_ideal());
  info.distortion_model = "rational_polynomial";
  info.d = {0.4, 0.1, 1e-4, 2e-4, 0.01, 0.8, 0.3, 0.04};
  CHECK(lens() == Lens(LensModel::kRadialTangential, info.d));
  info.d.resize(12, 0.0);
  CHECK(lens().coefficients().size() == 8);
  for (const char* name : {"equidistant", "fisheye"}) {
    info.distortion_model = name;
    info.d = {0.003, 7e-4, -2e-3, 2e-4};
    CHECK(lens() == Lens(LensModel::kEquidistant, info.d));
  }
  info.distortion_model = "";
  info.d = {};
  CHECK(lens().is_ideal());
}

TEST_CASE("The baseline is computed from P of the right camera") {
  CHECK(baseline_m(camera_info("right_optical", -43.0)).value() == Approx(0.1));
  CHECK(!baseline_m(camera_info("left_optical")));
  RosCameraInfo info = camera_info("right_optical", -43.0);
  info.p[3] = 43.0;  // a camera to the left
  CHECK(!baseline_m(info));
  info.p.fill(0.0);
  CHECK(!baseline_m(info));
}

TEST_CASE("The frame of a CameraInfo is the rectified camera's") {
  RosCameraInfo info = camera_info("left_optical");
  const Eigen::Matrix3d R = so3_exp({0.01, -0.03, 0.02});
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.r.data()) = R;
  // By the message's documentation R takes what the camera sees to the rectified camera.
  const Eigen::Vector3d p_raw(0.4, -0.3, 2.0);
  CHECK((T_frame_camera(info, RosImages::kRaw) * p_raw).isApprox(R * p_raw, 1e-12));
  CHECK(T_frame_camera(info, RosImages::kRectified).isApprox(SE3::Identity()));
  info.r.fill(0.0);
  CHECK(T_frame_camera(info, RosImages::kRaw).isApprox(SE3::Identity()));
  info.r[0] = 2.0;
  CHECK_THROWS_WITH(T_frame_camera(info, RosImages::kRaw),
                    Contains("frame 'left_optical': R is not a rotation"));
}

TEST_CASE("A CameraInfo that is no calibration is refused by frame and field") {
  struct Case {
    const char* why;
    void (*spoil)(RosCameraInfo&);
  };
  const Case c = GENERATE(
      Case{"K is 0: the camera is not calibrated", [](auto& info) { info.k.fill(0.0); }},
      Case{"width and height: sides are whole numbers", [](auto& info) { info.width = 0; }},
      Case{"K: a focal length of -457 px", [](auto& info) { info.k[4] = -457.0; }},
      Case{"K: a skew of 0.5", [](auto& info) { info.k[1] = 0.5; }},
      Case{"distortion_model 'thin_prism' is not supported, only plumb_bob",
           [](auto& info) { info.distortion_model = "thin_prism"; }},
      Case{"distortion_model '' is not supported", [](auto& info) { info.distortion_model = ""; }},
      Case{"D has 12 coefficients; of rational_polynomial only 8 are supported",
           [](auto& info) {
             info.distortion_model = "rational_polynomial";
             info.d = {0, 0, 0, 0, 0, 0, 0, 0, 1e-3, 0, 0, 0};
           }},
      Case{"binning_x 0, binning_y 2: binned images are not supported",
           [](auto& info) { info.binning_y = 2; }},
      Case{"roi: images of a part of the camera are not supported",
           [](auto& info) {
             info.roi.x_offset = 8;
             info.roi.height = 480;
             info.roi.width = 632;
           }},
      Case{"D: nan is outside", [](auto& info) { info.d[0] = std::nan(""); }});
  CAPTURE(c.why);
  RosCameraInfo info = camera_info("left_optical");
  c.spoil(info);
  CHECK_THROWS_WITH(camera_of(info, RosImages::kRaw),
                    Contains("frame 'left_optical': ") && Contains(c.why));
}

TEST_CASE("A rectified camera needs no K, and a raw one no P") {
  RosCameraInfo info = camera_info("left_optical");
  info.k.fill(0.0);
  CHECK(camera_of(info, RosImages::kRectified).fx == 430.0);
  CHECK_THROWS_WITH(camera_of(info, RosImages::kRaw), Contains("rectified: true"));
  info = camera_info("left_optical");
  info.p.fill(0.0);
  CHECK(camera_of(info, RosImages::kRaw).fx == 458.0);
  CHECK_THROWS_WITH(camera_of(info, RosImages::kRectified),
                    Contains("P is 0") && Contains("name their calibration in the rig file"));
}

}  // namespace
}  // namespace km
