#include "apps/lab/simulation/dataset/recording_texts.hpp"

#include <array>
#include <bit>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <vector>

#include "apps/lab/simulation/dataset/number_text.hpp"
#include "modules/core/json.hpp"

namespace km {
namespace {

void append(std::string& text, const Eigen::Vector3d& values) {
  for (int i = 0; i < 3; ++i) text += ',' + number_text(values[i]);
}

std::string heading(const char* type, const std::string& comment) {
  return std::string("sensor_type: ") + type + "\ncomment: " + comment + "\n\n";
}

// T_BS: the sensor's frame in the body's.
std::string extrinsics(const SE3& T_body_sensor) {
  std::ostringstream text;
  text << "T_BS:\n  cols: 4\n  rows: 4\n  data: [";
  const Eigen::Matrix4d& T = T_body_sensor.matrix();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column)
      text << number_text(T(row, column)) << (row == 3 && column == 3 ? "]\n\n" : ", ");
    if (row < 3) text << "\n         ";
  }
  return text.str();
}

std::string list_text(std::span<const double> values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i)
    text += (i == 0 ? "" : ", ") + number_text(values[i]);
  return text + ']';
}

// Kalibr's description of a lens: camera_model with the parameters before fu in its intrinsics, and
// distortion_model with its coefficients.
struct LensTexts {
  const char* camera_model = "pinhole";
  std::span<const double> first = {};
  const char* first_names = "";
  const char* distortion_model = "radial-tangential";
  std::span<const double> coefficients = {};
  const char* names = "k1, k2, p1, p2";
};

LensTexts texts_of(const Lens& lens) {
  const std::span<const double> k = lens.coefficients();
  switch (lens.model()) {
    case LensModel::kRadialTangential:
      return {.coefficients = k,
              .names = k.size() == 4 ? "k1, k2, p1, p2" : "k1, k2, p1, p2, k3, ..."};
    case LensModel::kEquidistant:
      return {.distortion_model = "equidistant", .coefficients = k, .names = "k1, k2, k3, k4"};
    case LensModel::kOmnidirectional:
      return {.camera_model = "omni",
              .first = k.first(1),
              .first_names = "xi, ",
              .coefficients = k.subspan(1)};
    case LensModel::kDoubleSphere:
      return {.camera_model = "ds",
              .first = k,
              .first_names = "xi, alpha, ",
              .distortion_model = "none",
              .names = "none"};
  }
  return {};
}

std::string optics(const Camera& camera, double rate_hz) {
  const LensTexts lens = texts_of(camera.lens);
  const double scale = lens.first.empty() ? 1.0 : 1.0 + lens.first[0];  // see Lens
  std::vector<double> intrinsics(lens.first.begin(), lens.first.end());
  intrinsics.insert(intrinsics.end(), {scale * camera.fx, scale * camera.fy, camera.cx, camera.cy});
  std::ostringstream text;
  text << "rate_hz: " << number_text(rate_hz) << "\nresolution: [" << camera.width << ", "
       << camera.height << "]\ncamera_model: " << lens.camera_model
       << "\nintrinsics: " << list_text(intrinsics) << "  # " << lens.first_names
       << "fu, fv, cu, cv [px]\ndistortion_model: " << lens.distortion_model
       << "\ndistortion_coefficients: " << list_text(lens.coefficients) << "  # " << lens.names
       << '\n';
  return text.str();
}

static_assert(std::endian::native == std::endian::little, "PLY is written as it lies in memory");

std::string ply_header(const SurfaceMesh& mesh) {
  return "ply\nformat binary_little_endian 1.0\ncomment frame world, metres, z up\n"
         "element vertex " +
         std::to_string(mesh.vertices.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nproperty uchar label\nproperty uchar red\n"
         "property uchar green\nproperty uchar blue\nend_header\n";
}

// Classes of things. Surfaces of the others are parts of the surroundings.
bool is_thing(SurfaceClass label) {
  using enum SurfaceClass;
  return label == kVehicle || label == kPole || label == kTent || label == kPerson ||
         label == kFurniture || label == kObject;
}

Eigen::Isometry3d turned(double yaw_rad) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
}

// Bounds of an object along its own axes, for each of its classes.
std::map<SurfaceClass, Eigen::AlignedBox3d> boxes_of(const World& world,
                                                     const WorldObject& object) {
  const Eigen::Isometry3d T_object_world = turned(-object.yaw_rad);
  std::map<SurfaceClass, Eigen::AlignedBox3d> boxes;
  for (std::size_t t = object.first_triangle; t < object.end_triangle; ++t) {
    Eigen::AlignedBox3d& box = boxes[world.materials.at(world.mesh.materials[t]).label];
    for (const std::uint32_t v : world.mesh.triangles[t])
      box.extend(T_object_world * world.mesh.vertices[v].cast<double>());
  }
  return boxes;
}

Json json_of(SurfaceClass label, const Eigen::AlignedBox3d& box, double yaw_rad,
             const LabelPalette& palette) {
  const Eigen::Vector3d center = turned(yaw_rad) * box.center(), size = box.sizes();
  return {{"layer", "object"},
          {"class", palette.find(static_cast<LabelId>(label))->name},
          {"label", static_cast<LabelId>(label)},
          {"center_m", {center.x(), center.y(), center.z()}},
          {"yaw_rad", yaw_rad},
          {"size_m", {size.x(), size.y(), size.z()}}};
}

}  // namespace

std::string imu_csv(const std::vector<ImuSample>& samples) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& sample : samples) {
    text += std::to_string(sample.stamp);
    append(text, sample.gyro);
    append(text, sample.accel);
    text += '\n';
  }
  return text;
}

std::string state_csv(const std::vector<TrueState>& states) {
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const TrueState& state : states) {
    const Eigen::Quaterniond q(state.T_world_body.linear());
    text += std::to_string(state.stamp);
    append(text, state.T_world_body.translation());
    text += ',' + number_text(q.w());
    append(text, q.vec());
    append(text, state.velocity_world);
    append(text, state.gyro_bias);
    append(text, state.accel_bias);
    text += '\n';
  }
  return text;
}

std::string image_csv(const std::vector<Stamp>& stamps, const std::string& extension) {
  std::string text = "#timestamp [ns],filename\n";
  for (const Stamp stamp : stamps)
    text += std::to_string(stamp) + ',' + std::to_string(stamp) + extension + '\n';
  return text;
}

std::string camera_yaml(const Camera& camera, double rate_hz, const std::string& comment) {
  return heading("camera", comment) + extrinsics(camera.T_body_cam) + optics(camera, rate_hz);
}

std::string depth_yaml(const Camera& camera, const DepthCameraFigures& figures,
                       const std::string& comment) {
  return heading("depth", comment) + extrinsics(camera.T_body_cam) +
         optics(camera, figures.rate_hz) +
         "depth_scale: 0.001  # [m] of a unit of the 16-bit images, along the optical axis\n"
         "min_range_m: " +
         number_text(figures.min_range_m) + "\nmax_range_m: " + number_text(figures.max_range_m) +
         "\nbaseline_m: " + number_text(figures.baseline_m) +
         "  # of the stereo camera that would have its errors\n";
}

std::string imu_yaml(const ImuNoise& noise, const std::string& comment) {
  std::ostringstream text;
  text << heading("imu", comment) << extrinsics(SE3::Identity())
       << "rate_hz: " << number_text(noise.rate_hz)
       << "\ngyroscope_noise_density: " << number_text(noise.gyro_noise_density)
       << "  # [rad/s/sqrt(Hz)]\ngyroscope_random_walk: " << number_text(noise.gyro_random_walk)
       << "  # [rad/s^2/sqrt(Hz)]\naccelerometer_noise_density: "
       << number_text(noise.accel_noise_density)
       << "  # [m/s^2/sqrt(Hz)]\naccelerometer_random_walk: "
       << number_text(noise.accel_random_walk) << "  # [m/s^3/sqrt(Hz)]\n";
  return text.str();
}

std::vector<std::uint8_t> world_ply(const World& world, const LabelPalette& palette) {
  constexpr std::size_t kVertexSize = 12;
  constexpr std::size_t kFaceSize = 17;
  const SurfaceMesh& mesh = world.mesh;
  const std::string head = ply_header(mesh);
  std::vector<std::uint8_t> bytes(head.begin(), head.end());
  bytes.reserve(head.size() + kVertexSize * mesh.vertices.size() +
                kFaceSize * mesh.triangles.size());
  const auto add = [&bytes](const void* values, std::size_t size) {  // appends the bytes of
                                                                     // `values` as they are in
                                                                     // memory
    const auto* const first = static_cast<const std::uint8_t*>(values);
    bytes.insert(bytes.end(), first, first + size);
  };
  for (const Eigen::Vector3f& vertex : mesh.vertices) add(vertex.data(), kVertexSize);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto label = static_cast<LabelId>(world.materials.at(mesh.materials[i]).label);
    const LabelClass* const shown = palette.find(label);
    const std::array<std::uint8_t, 3> color =
        shown == nullptr ? std::array<std::uint8_t, 3>{} : shown->color;
    constexpr std::uint8_t kCorners = 3;
    add(&kCorners, 1);
    add(mesh.triangles[i].data(), 12);
    add(&label, 1);
    add(color.data(), 3);
  }
  return bytes;
}

std::string true_objects_json(const World& world, const LabelPalette& palette) {
  Json objects = Json::array();
  for (const WorldObject& object : world.objects)
    for (const auto& [label, box] : boxes_of(world, object))
      if (is_thing(label)) objects.push_back(json_of(label, box, object.yaw_rad, palette));
  return json_text({{"objects", std::move(objects)}});
}

}  // namespace km
