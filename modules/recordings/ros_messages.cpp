#include "modules/recordings/ros_messages.hpp"

#include <concepts>
#include <type_traits>

#include "modules/recordings/ros_serialization.hpp"

namespace km {
namespace {

// The fields of each message in the order of ROS' definitions (github.com/ros2/common_interfaces).
// RosReader reads them into a message, and RosWriter writes them from a constant message.
template <typename Message, typename Type>
concept Is = std::same_as<std::remove_const_t<Message>, Type>;

void fields(auto& wire, Is<RosHeader> auto& header) {
  wire.skip_sequence();
  wire(header.stamp, header.frame);
}

void fields(auto& wire, Is<RosPose> auto& pose) {
  wire(pose.position, pose.orientation.coeffs());  // x, y, z, w, as in Eigen's storage
}

void fields(auto& wire, Is<RosImage> auto& image) {
  fields(wire, image.header);
  wire(image.height, image.width, image.encoding, image.is_bigendian, image.step, image.data);
  if (image.data.size() < std::uint64_t{image.step} * image.height) wire.fail();
}

void fields(auto& wire, Is<RosCompressedImage> auto& image) {
  fields(wire, image.header);
  wire(image.format, image.data);
}

void fields(auto& wire, Is<RosImu> auto& imu) {
  fields(wire, imu.header);
  wire(imu.orientation.coeffs(), imu.orientation_covariance);
  wire(imu.angular_velocity, imu.angular_velocity_covariance);
  wire(imu.linear_acceleration, imu.linear_acceleration_covariance);
}

void fields(auto& wire, Is<RosCameraInfo> auto& camera) {
  fields(wire, camera.header);
  wire(camera.height, camera.width, camera.distortion_model, camera.D, camera.K, camera.R, camera.P,
       camera.binning_x, camera.binning_y);
  auto& region = camera.region;
  wire(region.x_offset, region.y_offset, region.height, region.width, region.do_rectify);
}

void fields(auto& wire, Is<RosPoseStamped> auto& pose) {
  fields(wire, pose.header);
  fields(wire, pose.pose);
}

void fields(auto& wire, Is<RosPoseWithCovarianceStamped> auto& pose) {
  fields(wire, pose.header);
  fields(wire, pose.pose);
  wire(pose.covariance);
}

void fields(auto& wire, Is<RosPath> auto& path) {
  constexpr std::size_t kLeast_bytes = 7 * sizeof(double);
  fields(wire, path.header);
  wire.resize(path.poses, kLeast_bytes);
  for (auto& pose : path.poses) fields(wire, pose);
}

void fields(auto& wire, Is<RosOccupancyGrid> auto& grid) {
  fields(wire, grid.header);
  wire(grid.map_load_time, grid.resolution, grid.width, grid.height);
  fields(wire, grid.origin);
  wire(grid.data);
}

void fields(auto& wire, Is<RosOdometry> auto& odometry) {
  fields(wire, odometry.header);
  wire(odometry.child_frame);
  fields(wire, odometry.pose);
  wire(odometry.pose_covariance, odometry.linear_velocity, odometry.angular_velocity,
       odometry.twist_covariance);
}

void fields(auto& wire, Is<RosTransform> auto& transform) {
  fields(wire, transform.header);
  wire(transform.child_frame);
  fields(wire, transform.pose);
}

void fields(auto& wire, Is<RosNavSatFix> auto& fix) {
  fields(wire, fix.header);
  wire(fix.status, fix.service, fix.latitude, fix.longitude, fix.altitude, fix.position_covariance,
       fix.covariance_type);
}

void fields(auto& wire, Is<RosTransforms> auto& message) {
  constexpr std::size_t kLeast_bytes = 7 * sizeof(double);
  wire.resize(message.transforms, kLeast_bytes);
  for (auto& transform : message.transforms) fields(wire, transform);
}

void fields(auto& wire, Is<RosPointCloud> auto& cloud) {
  constexpr std::size_t kLeast_bytes = 4 + 4 + 1 + 4;
  fields(wire, cloud.header);
  wire(cloud.height, cloud.width);
  wire.resize(cloud.fields, kLeast_bytes);
  for (auto& field : cloud.fields) wire(field.name, field.offset, field.datatype, field.count);
  wire(cloud.is_bigendian, cloud.point_step, cloud.row_step, cloud.data, cloud.is_dense);
}

void fields(auto& wire, Is<RosDiagnosticStatus> auto& status) {
  constexpr std::size_t kLeast_bytes = 4 + 4;
  wire(status.level, status.name, status.message, status.hardware_id);
  wire.resize(status.values, kLeast_bytes);
  for (auto& entry : status.values) wire(entry.key, entry.value);
}

void fields(auto& wire, Is<RosDiagnostics> auto& diagnostics) {
  constexpr std::size_t kLeast_bytes = 1 + 4 * 4;
  fields(wire, diagnostics.header);
  wire.resize(diagnostics.status, kLeast_bytes);
  for (auto& status : diagnostics.status) fields(wire, status);
}

void fields(auto& wire, Is<RosMarker> auto& marker) {
  constexpr std::size_t kPoint_bytes = 3 * 8, kColor_bytes = 4 * 4, kTexture_bytes = 2 * 4;
  std::string blank;  // names of textures and mesh files, which are not used
  std::vector<Eigen::Vector2f> none;
  RosCompressedImage no_image;
  std::vector<std::uint8_t> no_file;
  bool no_materials = false;
  fields(wire, marker.header);
  wire(marker.name_space, marker.id, marker.type, marker.action);
  fields(wire, marker.pose);
  wire(marker.scale, marker.color, marker.lifetime, marker.frame_locked);
  wire.resize(marker.points, kPoint_bytes);
  for (auto& point : marker.points) wire(point);
  wire.resize(marker.colors, kColor_bytes);
  for (auto& color : marker.colors) wire(color);
  wire(blank);
  fields(wire, no_image);
  wire.resize(none, kTexture_bytes);
  for (auto& coordinates : none) wire(coordinates);
  wire(marker.text, blank, blank, no_file, no_materials);
}

void fields(auto& wire, Is<RosMarkers> auto& message) {
  constexpr std::size_t kLeast_bytes = 200;  // size of a marker without points
  wire.resize(message.markers, kLeast_bytes);
  for (auto& marker : message.markers) fields(wire, marker);
}

void fields(auto& wire, Is<RosLog> auto& log) {
  wire(log.stamp, log.level, log.name, log.text, log.file, log.function, log.line);
}

}  // namespace

bool is_of_type(const BagChannel& channel, std::string_view type) {
  const std::string_view name = channel.type;
  const std::size_t slash = type.find('/');
  const std::string_view package = type.substr(0, slash);
  const std::string_view message = type.substr(slash);
  if (name == type) return true;
  if (type == RosTransforms::kType && name == "tf/tfMessage") return true;  // former name
  return name.size() == type.size() + 4 && name.starts_with(package) &&
         name.substr(slash, 4) == "/msg" && name.ends_with(message);
}

template <typename Message>
Decoded<Message> decode_ros(std::string_view encoding, std::span<const std::uint8_t> bytes) {
  auto wire = RosReader::open(encoding, bytes);
  if (!wire.value) return Decoded<Message>::refuse(wire.refusal);
  Message message;
  fields(*wire.value, message);
  if (const char* const problem = wire.value->problem()) return Decoded<Message>::refuse(problem);
  return Decoded<Message>::accept(std::move(message));
}

template <>
Decoded<RosHeader> decode_ros(std::string_view encoding, std::span<const std::uint8_t> bytes) {
  auto wire = RosReader::open(encoding, bytes);
  if (!wire.value) return Decoded<RosHeader>::refuse(wire.refusal);
  RosHeader header;
  fields(*wire.value, header);
  if (wire.value->failed()) return Decoded<RosHeader>::refuse("a message without a header");
  return Decoded<RosHeader>::accept(std::move(header));
}

template <typename Message>
std::vector<std::uint8_t> encode_ros(const Message& message) {
  RosWriter wire;
  fields(wire, message);
  return wire.release();
}

template Decoded<RosImage> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosImage&);
template Decoded<RosCompressedImage> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosCompressedImage&);
template Decoded<RosImu> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosImu&);
template Decoded<RosCameraInfo> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosCameraInfo&);
template Decoded<RosPoseStamped> decode_ros(std::string_view, std::span<const std::uint8_t>);
template Decoded<RosPoseWithCovarianceStamped> decode_ros(std::string_view,
                                                          std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosPoseStamped&);
template std::vector<std::uint8_t> encode_ros(const RosPoseWithCovarianceStamped&);
template Decoded<RosPath> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosPath&);
template Decoded<RosOccupancyGrid> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosOccupancyGrid&);
template Decoded<RosOdometry> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosOdometry&);
template Decoded<RosTransform> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosTransform&);
template Decoded<RosNavSatFix> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosNavSatFix&);
template Decoded<RosTransforms> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosTransforms&);
template Decoded<RosPointCloud> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosPointCloud&);
template Decoded<RosDiagnostics> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosDiagnostics&);
template Decoded<RosMarker> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosMarker&);
template Decoded<RosMarkers> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosMarkers&);
template Decoded<RosLog> decode_ros(std::string_view, std::span<const std::uint8_t>);
template std::vector<std::uint8_t> encode_ros(const RosLog&);

}  // namespace km
