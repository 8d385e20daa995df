#include <catch2/catch.hpp>

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <span>

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

// Writes fields as a ROS does. Doubles ascend from 0.5.
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
};

Bytes sample(std::string_view type, Wire wire) {
  SampleWriter out(wire);
  if (type != RosTFMessage::kType) out.header();
  if (type == RosImage::kType) {
    out.u32(2);
    out.u32(3);
    out.text("mono8");
    out.u8(1);
    out.u32(3);
    out.octets(6);
  } else if (type == RosOdometry::kType) {
    out.text("body");
    out.doubles(7 + 36 + 6 + 36);
  } else if (type == RosTFMessage::kType) {
    out.u32(2);
    for (const char* const child : {"body", "imu"}) {
      out.header();
      out.text(child);
      out.doubles(7);
    }
  }
  return out.finish();
}

// Calls `use` with a message of each type of the samples.
void for_each_type(const auto& use) {
  use(RosImage{});
  use(RosOdometry{});
  use(RosTFMessage{});
}

}  // namespace

TEST_CASE("The samples are the bytes that ROS and a CDR library of others write", "[recordings]") {
  // CRC-32 of the same values written by Debian's python3-genpy (1.15) and npm's @foxglove/cdr.
  struct Known {
    std::string_view type;
    std::size_t size;
    std::uint32_t ros1, little, big;
  };
  const Known known = GENERATE(Known{RosImage::kType, 62, 1826543053, 407626829, 561362619},
                               Known{RosOdometry::kType, 724, 3409642595, 3375888727, 179772071},
                               Known{RosTFMessage::kType, 188, 3411167409, 2874389248, 3812940711});
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

// Little-endian CDR is compared with another library's in test_golden_messages.cpp.
TEST_CASE("Messages of any encoding are read, and refused when cut, longer or corrupted",
          "[recordings]") {
  const Wire wire = GENERATE(Wire::kRos1, Wire::kLittleEndian, Wire::kBigEndian);
  CAPTURE(static_cast<int>(wire));
  for_each_type([&]<typename Message>(const Message&) {
    CAPTURE(Message::kType);
    const auto read = [&](std::span<const std::uint8_t> bytes) {
      return decode_ros<Message>(encoding_of(wire), bytes);
    };
    Bytes bytes = sample(Message::kType, wire);
    const auto message = read(bytes);
    CAPTURE(message.refusal);
    REQUIRE(message.value);
    CHECK(encode_ros(*message.value) == sample(Message::kType, Wire::kLittleEndian));
    for (std::size_t size = 0; size < bytes.size(); ++size)
      CHECK(read(std::span(bytes).first(size)).refusal);
    unsigned refused = 0;
    for (unsigned seed = 0; seed < corrupted_files(); ++seed) {
      const auto result = read(InputCorrupter(seed)({bytes}));
      CHECK(result.value.has_value() == (result.refusal == nullptr));
      refused += result.value ? 0 : 1;
    }
    CHECK(refused > 0);
    CHECK(refused < corrupted_files());
    bytes.resize(bytes.size() + 4);
    CHECK(read(bytes).refusal);
  });
}

TEST_CASE("The header is read from the beginning of any message", "[recordings]") {
  const Wire wire = GENERATE(Wire::kRos1, Wire::kLittleEndian, Wire::kBigEndian);
  const Bytes bytes = sample(RosOdometry::kType, wire);
  const auto header = decode_ros<RosHeader>(encoding_of(wire), bytes);
  REQUIRE(header.value);
  CHECK(header.value->stamp == 1661164286607675136);
  CHECK(header.value->frame_id == "left_cam");
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
  const RosPoseStamped before_1970{{-1, "odom"}, {}};
  CHECK(decode_ros<RosPoseStamped>("cdr", encode_ros(before_1970)).value->header.stamp == -1);
}

TEST_CASE("Unknown encodings, and images with fewer pixels than they state, are refused",
          "[recordings]") {
  Bytes bytes = sample(RosImage::kType, Wire::kRos1);
  const std::size_t height = 4 + 8 + 4 + 8;
  REQUIRE(bytes[height] == 2);
  bytes[height] = 3;
  CHECK(decode_ros<RosImage>("ros1", bytes).refusal);
  bytes = sample(RosOdometry::kType, Wire::kLittleEndian);
  CHECK(decode_ros<RosOdometry>("json", bytes).refusal);
  for (const std::uint8_t kind :
       {std::uint8_t{2}, std::uint8_t{3}, std::uint8_t{7}}) {  // parameter lists and version 2
    bytes[1] = kind;
    CHECK(decode_ros<RosOdometry>("cdr", bytes).refusal);
  }
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
  CHECK(is_of_type({.topic = "", .type = "tf/tfMessage", .encoding = ""}, RosTFMessage::kType));
}

}  // namespace km
