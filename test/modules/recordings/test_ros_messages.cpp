#include <catch2/catch.hpp>

#include <zlib.h>

#include <algorithm>
#include <bit>

#include "modules/core/bytes.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/support/corrupted_input.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

enum class Wire { kRos1, kLittleEndian, kBigEndian };

const char* encoding_of(Wire wire) {
  return wire == Wire::kRos1 ? "ros1" : "cdr";
}

// Writes fields as a ROS does. Doubles ascend from 0.5, counts from 100.
class SampleWriter {
 public:
  explicit SampleWriter(Wire wire) : wire_(wire) {}

  void u8(std::uint8_t value) { bytes_.push_back(value); }
  void u32(std::uint32_t value) { number(value, 4); }
  void text(const std::string& value) {
    const std::size_t end = wire_ == Wire::kRos1 ? 0 : 1;
    u32(static_cast<std::uint32_t>(value.size() + end));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.insert(bytes_.end(), end, 0);
  }
  void octets(std::uint8_t count) {
    u32(count);
    for (std::uint8_t k = 1; k <= count; ++k) u8(k);
  }
  void header() {
    if (wire_ == Wire::kRos1) u32(77);
    u32(1661164286);
    u32(607675136);
    text("left_cam");
  }
  void doubles(int count) {
    for (int k = 0; k < count; ++k) number(std::bit_cast<std::uint64_t>(next_double_++), 8);
  }
  void counts(int count) {
    for (int k = 0; k < count; ++k) u32(next_count_++);
  }

  [[nodiscard]] Bytes finish() const {
    if (wire_ == Wire::kRos1) return bytes_;
    Bytes whole = {0, static_cast<std::uint8_t>(wire_ == Wire::kLittleEndian ? 1 : 0), 0, 0};
    whole.insert(whole.end(), bytes_.begin(), bytes_.end());
    return whole;
  }

 private:
  void number(std::uint64_t value, std::size_t size) {
    while (wire_ != Wire::kRos1 && bytes_.size() % size != 0) bytes_.push_back(0);
    for (std::size_t k = 0; k < size; ++k) {
      const std::size_t place = wire_ == Wire::kBigEndian ? size - 1 - k : k;
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * place)));
    }
  }

  Wire wire_;
  Bytes bytes_;
  double next_double_ = 0.5;
  std::uint32_t next_count_ = 100;
};

Bytes sample(std::string_view type, Wire wire) {
  SampleWriter out(wire);
  if (type != RosTransforms::kType) out.header();
  if (type == RosImage::kType) {
    out.u32(2);
    out.u32(3);
    out.text("mono8");
    out.u8(1);
    out.u32(3);
    out.octets(6);
  } else if (type == RosCompressedImage::kType) {
    out.text("jpeg");
    out.octets(7);
  } else if (type == RosImu::kType) {
    out.doubles(4 + 9 + 3 + 9 + 3 + 9);
  } else if (type == RosCameraInfo::kType) {
    out.counts(2);
    out.text("plumb_bob");
    out.u32(5);
    out.doubles(5 + 9 + 9 + 12);
    out.counts(6);
    out.u8(1);
  } else if (type == RosPoseStamped::kType) {
    out.doubles(7);
  } else if (type == RosOdometry::kType) {
    out.text("body");
    out.doubles(7 + 36 + 6 + 36);
  } else if (type == RosTransforms::kType) {
    out.u32(2);
    for (const char* const child : {"body", "imu"}) {
      out.header();
      out.text(child);
      out.doubles(7);
    }
  }
  return out.finish();
}

template <typename Message>
Message decoded(Wire wire) {
  const Bytes bytes = sample(Message::kType, wire);
  auto result = decode_ros<Message>(encoding_of(wire), bytes);
  CAPTURE(Message::kType, result.refusal);
  REQUIRE(result.value);
  return *std::move(result.value);
}

void check_header(const RosHeader& header) {
  CHECK(header.stamp == 1661164286607675136);
  CHECK(header.frame == "left_cam");
}

void check_pose(const RosPose& pose, double first) {
  CHECK(pose.position == Eigen::Vector3d(first, first + 1, first + 2));
  CHECK(pose.orientation.coeffs() == Eigen::Vector4d(first + 3, first + 4, first + 5, first + 6));
}

// Any type, for its refusals.
template <typename... Messages>
struct Types {
  template <typename Use>
  static void for_each(const Use& use) {
    (use(Messages{}), ...);
  }
};
using AllTypes = Types<RosImage, RosCompressedImage, RosImu, RosCameraInfo, RosPoseStamped,
                       RosOdometry, RosTransforms>;

}  // namespace

TEST_CASE("The samples are the bytes that ROS and a CDR library of others write", "[recordings]") {
  // CRC-32 of the same values written by Debian's python3-genpy (1.15) and npm's @foxglove/cdr.
  struct Known {
    std::string_view type;
    std::size_t size;
    std::uint32_t ros1, little, big;
  };
  const Known known =
      GENERATE(Known{RosImage::kType, 62, 1826543053, 407626829, 561362619},
               Known{RosCompressedImage::kType, 51, 957441573, 1100516013, 4219373744},
               Known{RosImu::kType, 324, 1379809172, 1929394152, 3860211658},
               Known{RosCameraInfo::kType, 365, 1865646328, 1051660117, 3098248949},
               Known{RosPoseStamped::kType, 84, 1184535022, 2363827960, 1370879804},
               Known{RosOdometry::kType, 724, 3409642595, 3375888727, 179772071},
               Known{RosTransforms::kType, 188, 3411167409, 2874389248, 3812940711});
  CAPTURE(known.type);
  const auto crc_of = [&](Wire wire) {
    const Bytes bytes = sample(known.type, wire);
    return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
  };
  CHECK(sample(known.type, Wire::kLittleEndian).size() == known.size);
  CHECK(crc_of(Wire::kRos1) == known.ros1);
  CHECK(crc_of(Wire::kLittleEndian) == known.little);
  CHECK(crc_of(Wire::kBigEndian) == known.big);
}

TEST_CASE("Messages of ROS 1 and 2 are read field by field", "[recordings]") {
  const Wire wire = GENERATE(Wire::kRos1, Wire::kLittleEndian, Wire::kBigEndian);
  CAPTURE(static_cast<int>(wire));
  const auto image = decoded<RosImage>(wire);
  check_header(image.header);
  CHECK(image.height == 2);
  CHECK(image.width == 3);
  CHECK(image.encoding == "mono8");
  CHECK(image.is_bigendian);
  CHECK(image.step == 3);
  CHECK(image.data == Bytes{1, 2, 3, 4, 5, 6});

  const auto compressed = decoded<RosCompressedImage>(wire);
  check_header(compressed.header);
  CHECK(compressed.format == "jpeg");
  CHECK(compressed.data == Bytes{1, 2, 3, 4, 5, 6, 7});

  const auto imu = decoded<RosImu>(wire);
  check_header(imu.header);
  CHECK(imu.orientation.coeffs() == Eigen::Vector4d(0.5, 1.5, 2.5, 3.5));
  CHECK(imu.orientation_covariance.front() == 4.5);
  CHECK(imu.angular_velocity == Eigen::Vector3d(13.5, 14.5, 15.5));
  CHECK(imu.angular_velocity_covariance.back() == 24.5);
  CHECK(imu.linear_acceleration == Eigen::Vector3d(25.5, 26.5, 27.5));
  CHECK(imu.linear_acceleration_covariance.back() == 36.5);

  const auto camera = decoded<RosCameraInfo>(wire);
  CHECK(camera.height == 100);
  CHECK(camera.width == 101);
  CHECK(camera.distortion_model == "plumb_bob");
  CHECK(camera.D == std::vector{0.5, 1.5, 2.5, 3.5, 4.5});
  CHECK(camera.K.front() == 5.5);
  CHECK(camera.R.front() == 14.5);
  CHECK(camera.P.front() == 23.5);
  CHECK(camera.P.back() == 34.5);
}

TEST_CASE("Poses of ROS 1 and 2 are read field by field", "[recordings]") {
  const Wire wire = GENERATE(Wire::kRos1, Wire::kLittleEndian, Wire::kBigEndian);
  CAPTURE(static_cast<int>(wire));
  const auto pose = decoded<RosPoseStamped>(wire);
  check_header(pose.header);
  check_pose(pose.pose, 0.5);

  const auto odometry = decoded<RosOdometry>(wire);
  check_header(odometry.header);
  CHECK(odometry.child_frame == "body");
  check_pose(odometry.pose, 0.5);
  CHECK(odometry.pose_covariance.front() == 7.5);
  CHECK(odometry.linear_velocity == Eigen::Vector3d(43.5, 44.5, 45.5));
  CHECK(odometry.angular_velocity == Eigen::Vector3d(46.5, 47.5, 48.5));
  CHECK(odometry.twist_covariance.back() == 84.5);

  const auto transforms = decoded<RosTransforms>(wire).transforms;
  REQUIRE(transforms.size() == 2);
  check_header(transforms[1].header);
  CHECK(transforms[0].child_frame == "body");
  CHECK(transforms[1].child_frame == "imu");
  check_pose(transforms[0].pose, 0.5);
  check_pose(transforms[1].pose, 7.5);
}

TEST_CASE("A message that was read is written as it was", "[recordings]") {
  AllTypes::for_each([]<typename Message>(const Message&) {
    CAPTURE(Message::kType);
    const Bytes expected = sample(Message::kType, Wire::kLittleEndian);
    CHECK(encode_ros(decoded<Message>(Wire::kRos1)) == expected);
  });
  const RosPoseStamped before_1970{{-1, "odom"}, {}};
  CHECK(decode_ros<RosPoseStamped>("cdr", encode_ros(before_1970)).value->header.stamp == -1);
}

TEST_CASE("A message that is too short or too long is refused", "[recordings]") {
  const Wire wire = GENERATE(Wire::kRos1, Wire::kLittleEndian, Wire::kBigEndian);
  AllTypes::for_each([&]<typename Message>(const Message&) {
    CAPTURE(Message::kType);
    Bytes bytes = sample(Message::kType, wire);
    for (std::size_t size = 0; size < bytes.size(); ++size)
      CHECK(decode_ros<Message>(encoding_of(wire), std::span(bytes).first(size)).refusal);
    bytes.resize(bytes.size() + 4);
    CHECK(decode_ros<Message>(encoding_of(wire), bytes).refusal);
  });
}

TEST_CASE("The header is read from the beginning of any message", "[recordings]") {
  const Wire wire = GENERATE(Wire::kRos1, Wire::kLittleEndian, Wire::kBigEndian);
  const Bytes bytes = sample(RosOdometry::kType, wire);
  const auto header = decode_ros<RosHeader>(encoding_of(wire), bytes);
  REQUIRE(header.value);
  check_header(*header.value);
  CHECK(decode_ros<RosHeader>(encoding_of(wire), std::span(bytes).first(20)).refusal);
}

TEST_CASE("Stamps before 1970 are ROS 2's and those after 2038 ROS 1's", "[recordings]") {
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
}

TEST_CASE("Images with fewer pixels than they state are refused", "[recordings]") {
  Bytes bytes = sample(RosImage::kType, Wire::kRos1);
  const std::size_t height = 4 + 8 + 4 + 8;
  REQUIRE(bytes[height] == 2);
  bytes[height] = 3;
  CHECK(decode_ros<RosImage>("ros1", bytes).refusal);
}

TEST_CASE("Encodings that are not known are refused", "[recordings]") {
  Bytes bytes = sample(RosImu::kType, Wire::kLittleEndian);
  CHECK(decode_ros<RosImu>("json", bytes).refusal);
  const std::uint8_t kind = GENERATE(std::uint8_t{2}, std::uint8_t{3}, std::uint8_t{7});
  bytes[1] = kind;  // parameter lists and version 2
  CHECK(decode_ros<RosImu>("cdr", bytes).refusal);
}

TEST_CASE("Corrupted messages are refused or read", "[recordings]") {
  const Wire wire = GENERATE(Wire::kRos1, Wire::kLittleEndian, Wire::kBigEndian);
  AllTypes::for_each([&]<typename Message>(const Message&) {
    const std::vector<Bytes> samples = {sample(Message::kType, wire)};
    unsigned refused = 0;
    for (unsigned seed = 0; seed < corrupted_files(); ++seed) {
      const auto result = decode_ros<Message>(encoding_of(wire), InputCorrupter(seed)(samples));
      CHECK(result.value.has_value() == (result.refusal == nullptr));
      refused += result.value ? 0 : 1;
    }
    CHECK(refused > 0);
    CHECK(refused < corrupted_files());
  });
}

TEST_CASE("Types are known by their names in ROS 1 and 2", "[recordings]") {
  const auto is_image = [](const std::string& type) {
    return is_of_type(BagChannel{.topic = "", .type = type, .encoding = ""}, RosImage::kType);
  };
  CHECK(is_image("sensor_msgs/Image"));
  CHECK(is_image("sensor_msgs/msg/Image"));
  CHECK_FALSE(is_image("sensor_msgs/srv/Image"));
  CHECK_FALSE(is_image("sensor_msgs/CompressedImage"));
  CHECK_FALSE(is_image("sensor_msgs/msg/Images"));
  CHECK_FALSE(is_image(""));
  CHECK(is_of_type({.topic = "", .type = "tf/tfMessage", .encoding = ""}, RosTransforms::kType));
}

}  // namespace km
