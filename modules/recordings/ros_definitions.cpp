#include "modules/recordings/ros_definitions.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <vector>

namespace km {
namespace {

struct Definition {
  std::string_view type;
  std::string_view fields;
};

// As of ROS 2 Humble: github.com/ros2/common_interfaces, geometry2, rcl_interfaces.
constexpr std::array kDefinitions = std::to_array<Definition>({
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    {"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"},
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    {"geometry_msgs/Pose",
     "geometry_msgs/Point position\n"
     "geometry_msgs/Quaternion orientation\n"},
    {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/PoseWithCovarianceStamped",
     "std_msgs/Header header\n"
     "geometry_msgs/PoseWithCovariance pose\n"},
    {"geometry_msgs/Twist",
     "geometry_msgs/Vector3 linear\n"
     "geometry_msgs/Vector3 angular\n"},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/Transform",
     "geometry_msgs/Vector3 translation\n"
     "geometry_msgs/Quaternion rotation\n"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\n"
     "string child_frame_id\n"
     "geometry_msgs/Transform transform\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\n"
     "string child_frame_id\n"
     "geometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
    {"nav_msgs/MapMetaData",
     "builtin_interfaces/Time map_load_time\n"
     "float32 resolution\n"
     "uint32 width\n"
     "uint32 height\n"
     "geometry_msgs/Pose origin\n"},
    {"nav_msgs/OccupancyGrid",
     "std_msgs/Header header\n"
     "nav_msgs/MapMetaData info\n"
     "int8[] data\n"},
    {"sensor_msgs/PointField",
     "string name\n"
     "uint32 offset\n"
     "uint8 datatype\n"
     "uint32 count\n"},
    {"sensor_msgs/PointCloud2",
     "std_msgs/Header header\n"
     "uint32 height\n"
     "uint32 width\n"
     "sensor_msgs/PointField[] fields\n"
     "bool is_bigendian\n"
     "uint32 point_step\n"
     "uint32 row_step\n"
     "uint8[] data\n"
     "bool is_dense\n"},
    {"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    {"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    {"diagnostic_msgs/DiagnosticStatus",
     "byte level\n"
     "string name\n"
     "string message\n"
     "string hardware_id\n"
     "diagnostic_msgs/KeyValue[] values\n"},
    {"diagnostic_msgs/DiagnosticArray",
     "std_msgs/Header header\n"
     "diagnostic_msgs/DiagnosticStatus[] status\n"},
    {"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
    {"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"},
    {"visualization_msgs/Marker",
     "std_msgs/Header header\n"
     "string ns\n"
     "int32 id\n"
     "int32 type\n"
     "int32 action\n"
     "geometry_msgs/Pose pose\n"
     "geometry_msgs/Vector3 scale\n"
     "std_msgs/ColorRGBA color\n"
     "builtin_interfaces/Duration lifetime\n"
     "bool frame_locked\n"
     "geometry_msgs/Point[] points\n"
     "std_msgs/ColorRGBA[] colors\n"
     "string texture_resource\n"
     "sensor_msgs/CompressedImage texture\n"
     "visualization_msgs/UVCoordinate[] uv_coordinates\n"
     "string text\n"
     "string mesh_resource\n"
     "visualization_msgs/MeshFile mesh_file\n"
     "bool mesh_use_embedded_materials\n"},
    {"visualization_msgs/MarkerArray", "visualization_msgs/Marker[] markers\n"},
    {"rcl_interfaces/Log",
     "builtin_interfaces/Time stamp\n"
     "uint8 level\n"
     "string name\n"
     "string msg\n"
     "string file\n"
     "string function\n"
     "uint32 line\n"},
});

const Definition& definition_of(std::string_view type) {
  const auto* const known = std::ranges::find(kDefinitions, type, &Definition::type);
  if (known == kDefinitions.end())
    throw std::invalid_argument("no definition of messages of " + std::string(type));
  return *known;
}

// Types of messages in a list of fields. A blank, or "[" for arrays, follows the type of a field.
std::vector<std::string_view> types_in(std::string_view fields) {
  std::vector<std::string_view> types;
  while (!fields.empty()) {
    const std::string_view type = fields.substr(0, fields.find_first_of(" ["));
    if (type.find('/') != type.npos) types.push_back(type);
    fields.remove_prefix(fields.find('\n') + 1);
  }
  return types;
}

}  // namespace

std::string ros_definition(std::string_view type) {
  constexpr std::size_t kRule = 80;  // characters
  const std::string rule(kRule, '=');
  std::string text(definition_of(type).fields);
  std::vector<std::string_view> types = types_in(definition_of(type).fields);
  for (std::size_t k = 0; k < types.size(); ++k) {
    if (std::ranges::find(types, types[k]) - types.begin() != static_cast<std::ptrdiff_t>(k))
      continue;
    const std::string_view fields = definition_of(types[k]).fields;
    text += rule + "\nMSG: " + std::string(types[k]) + '\n' + std::string(fields);
    const auto more = types_in(fields);
    types.insert(types.end(), more.begin(), more.end());
  }
  return text;
}

std::string ros2_name(std::string_view type) {
  const std::size_t slash = type.find('/');
  return std::string(type.substr(0, slash)) + "/msg" + std::string(type.substr(slash));
}

std::string ros1_name(std::string_view type) {
  const std::size_t slash = type.find("/msg/");
  if (slash == type.npos) return std::string(type);
  return std::string(type.substr(0, slash)) + std::string(type.substr(slash + 4));
}

std::string ros_name(std::string name) {
  for (char& c : name) {
    const bool is_fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!is_fine) c = '_';
  }
  return name;
}

}  // namespace km
