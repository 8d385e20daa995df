#include "modules/recordings/ros_messages.hpp"

#include "modules/recordings/ros_wire.hpp"

namespace km {
namespace {

// Fields stand in the order of ROS' definitions: github.com/ros2/common_interfaces.

void read(RosWire& wire, RosHeader& header) {
  wire.skip_sequence();
  header.stamp = wire.stamp();
  header.frame = wire.text();
}

void read(RosWire& wire, Eigen::Vector3d& vector) {
  wire.f64(std::span(vector.data(), 3));
}

// x, y, z, w, as Eigen keeps them.
void read(RosWire& wire, Eigen::Quaterniond& rotation) {
  wire.f64(std::span(rotation.coeffs().data(), 4));
}

void read(RosWire& wire, RosPose& pose) {
  read(wire, pose.position);
  read(wire, pose.orientation);
}

void read(RosWire& wire, RosImage& image) {
  read(wire, image.header);
  image.height = wire.u32();
  image.width = wire.u32();
  image.encoding = wire.text();
  image.is_bigendian = wire.u8() != 0;
  image.step = wire.u32();
  image.data = wire.octets();
  if (image.data.size() < std::uint64_t{image.step} * image.height) wire.fail();
}

void read(RosWire& wire, RosCompressedImage& image) {
  read(wire, image.header);
  image.format = wire.text();
  image.data = wire.octets();
}

void read(RosWire& wire, RosImu& imu) {
  read(wire, imu.header);
  read(wire, imu.orientation);
  wire.f64(imu.orientation_covariance);
  read(wire, imu.angular_velocity);
  wire.f64(imu.angular_velocity_covariance);
  read(wire, imu.linear_acceleration);
  wire.f64(imu.linear_acceleration_covariance);
}

void read(RosWire& wire, RosCameraInfo& camera) {
  read(wire, camera.header);
  camera.height = wire.u32();
  camera.width = wire.u32();
  camera.distortion_model = wire.text();
  camera.D = wire.doubles();
  wire.f64(camera.K);
  wire.f64(camera.R);
  wire.f64(camera.P);
  // Binning in x and y; of the region of interest x, y, height and width.
  for (int k = 0; k < 6; ++k) static_cast<void>(wire.u32());
  static_cast<void>(wire.u8());  // whether the region is to be rectified
}

void read(RosWire& wire, RosPoseStamped& pose) {
  read(wire, pose.header);
  read(wire, pose.pose);
}

void read(RosWire& wire, RosOdometry& odometry) {
  read(wire, odometry.header);
  odometry.child_frame = wire.text();
  read(wire, odometry.pose);
  wire.f64(odometry.pose_covariance);
  read(wire, odometry.linear_velocity);
  read(wire, odometry.angular_velocity);
  wire.f64(odometry.twist_covariance);
}

void read(RosWire& wire, RosTransforms& message) {
  constexpr std::size_t kLeast_bytes = 7 * sizeof(double);
  message.transforms.resize(wire.count(kLeast_bytes));
  for (RosTransform& transform : message.transforms) {
    read(wire, transform.header);
    transform.child_frame = wire.text();
    read(wire, transform.pose);
  }
}

}  // namespace

bool is_of_type(const BagChannel& channel, std::string_view type) {
  const std::string_view name = channel.type;
  const std::size_t slash = type.find('/');
  const std::string_view package = type.substr(0, slash);
  const std::string_view message = type.substr(slash);
  if (name == type) return true;
  if (type == RosTransforms::kType && name == "tf/tfMessage") return true;  // its first name
  return name.size() == type.size() + 4 && name.starts_with(package) &&
         name.substr(slash, 4) == "/msg" && name.ends_with(message);
}

template <typename Message>
Decoded<Message> decode_ros(std::string_view encoding, std::span<const std::uint8_t> bytes) {
  auto wire = RosWire::open(encoding, bytes);
  if (!wire.value) return Decoded<Message>::refuse(wire.refusal);
  Message message;
  read(*wire.value, message);
  if (const char* const problem = wire.value->problem()) return Decoded<Message>::refuse(problem);
  return Decoded<Message>::accept(std::move(message));
}

template <>
Decoded<RosHeader> decode_ros(std::string_view encoding, std::span<const std::uint8_t> bytes) {
  auto wire = RosWire::open(encoding, bytes);
  if (!wire.value) return Decoded<RosHeader>::refuse(wire.refusal);
  RosHeader header;
  read(*wire.value, header);
  if (wire.value->failed()) return Decoded<RosHeader>::refuse("a message without a header");
  return Decoded<RosHeader>::accept(std::move(header));
}

template Decoded<RosImage> decode_ros(std::string_view, std::span<const std::uint8_t>);
template Decoded<RosCompressedImage> decode_ros(std::string_view, std::span<const std::uint8_t>);
template Decoded<RosImu> decode_ros(std::string_view, std::span<const std::uint8_t>);
template Decoded<RosCameraInfo> decode_ros(std::string_view, std::span<const std::uint8_t>);
template Decoded<RosPoseStamped> decode_ros(std::string_view, std::span<const std::uint8_t>);
template Decoded<RosOdometry> decode_ros(std::string_view, std::span<const std::uint8_t>);
template Decoded<RosTransforms> decode_ros(std::string_view, std::span<const std::uint8_t>);

}  // namespace km
