#include "apps/lab/simulation/dataset/recording.hpp"

#include <algorithm>
#include <bit>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "modules/core/config.hpp"
#include "modules/core/io/json.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"

namespace km {
namespace {

constexpr int kJpegQuality = 92;

namespace fs = std::filesystem;

}  // namespace

std::vector<std::uint8_t> encode_gray(const GrayImage& image) {
  return encode_jpeg(view(image), kJpegQuality);
}

std::vector<std::uint8_t> encode_depth(int width, int height,
                                       const std::vector<std::uint16_t>& depth_mm) {
  return encode_png(view(width, height, CV_16UC1, depth_mm));
}

std::vector<std::uint8_t> encode_labels(int width, int height, const std::vector<LabelId>& labels) {
  return encode_png(view(width, height, CV_8UC1, labels));
}

std::filesystem::path RecordingLayout::folder(ImageChannel channel) const {
  constexpr std::array kNames = {"cam0", "cam1", "depth0", "label0"};
  return mav0_ / kNames.at(static_cast<std::size_t>(channel));
}

std::filesystem::path RecordingLayout::image(ImageChannel channel, Stamp stamp) const {
  return folder(channel) / "data" / (std::to_string(stamp) + image_extension(channel));
}

std::filesystem::path RecordingLayout::list(ImageChannel channel) const {
  return folder(channel) / "data.csv";
}

std::filesystem::path RecordingLayout::calibration(ImageChannel channel) const {
  return folder(channel) / "sensor.yaml";
}

std::filesystem::path RecordingLayout::truth() const {
  return mav0_ / "state_groundtruth_estimate0" / "data.csv";
}

const char* RecordingLayout::image_extension(ImageChannel channel) {
  const bool lossless = channel == ImageChannel::kDepth || channel == ImageChannel::kLabels;
  return lossless ? ".png" : ".jpg";
}

void write_whole_file(const fs::path& file, std::string_view bytes) {
  if (!fs::exists(file.parent_path())) fs::create_directories(file.parent_path());
  write_file(file, bytes);
}

void write_whole_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
  write_whole_file(file,
                   std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

bool is_whole_image(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::array<char, 8> tail{};
  if (!stream.seekg(-8, std::ios::end) || !stream.read(tail.data(), tail.size())) return false;
  const std::string_view end(tail.data(), tail.size());
  return file.extension() == ".png" ? end == "IEND\xAE\x42\x60\x82" : end.ends_with("\xFF\xD9");
}

namespace {

void append(std::string& text, const Eigen::Vector3d& values) {
  for (int i = 0; i < 3; ++i) text += ',' + shortest_text(values[i]);
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
      text << shortest_text(T(row, column)) << (row == 3 && column == 3 ? "]\n\n" : ", ");
    if (row < 3) text << "\n         ";
  }
  return text.str();
}

std::string list_text(std::span<const double> values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i)
    text += (i == 0 ? "" : ", ") + shortest_text(values[i]);
  return text + ']';
}

std::string optics(const Camera& camera, double rate_hz) {
  std::ostringstream text;
  text << "rate_hz: " << shortest_text(rate_hz) << "\nresolution: [" << camera.width << ", "
       << camera.height << "]\ncamera_model: pinhole\nintrinsics: "
       << list_text(std::array{camera.fx, camera.fy, camera.cx, camera.cy})
       << "  # fu, fv, cu, cv [px]\ndistortion_model: radial-tangential\ndistortion_coefficients: "
       << list_text(camera.lens.coefficients()) << "  # k1, k2, p1, p2\n";
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
    text += ',' + shortest_text(q.w());
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
         shortest_text(figures.min_range_m) +
         "\nmax_range_m: " + shortest_text(figures.max_range_m) +
         "\nbaseline_m: " + shortest_text(figures.baseline_m) +
         "  # of the stereo camera that would have its errors\n";
}

std::string imu_yaml(const ImuNoise& noise, const std::string& comment) {
  std::ostringstream text;
  text << heading("imu", comment) << extrinsics(SE3::Identity())
       << "rate_hz: " << shortest_text(noise.rate_hz)
       << "\ngyroscope_noise_density: " << shortest_text(noise.gyro_noise_density)
       << "  # [rad/s/sqrt(Hz)]\ngyroscope_random_walk: " << shortest_text(noise.gyro_random_walk)
       << "  # [rad/s^2/sqrt(Hz)]\naccelerometer_noise_density: "
       << shortest_text(noise.accel_noise_density)
       << "  # [m/s^2/sqrt(Hz)]\naccelerometer_random_walk: "
       << shortest_text(noise.accel_random_walk) << "  # [m/s^3/sqrt(Hz)]\n";
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
