#include "modules/sensors/euroc_rig.hpp"

#include <yaml-cpp/yaml.h>

#include <Eigen/LU>
#include <cmath>
#include <string>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

constexpr double kMaxNonOrthonormality = 1e-3;
constexpr double kMinBaseline_m = 1e-3;

// One sensor.yaml; every getter throws with file and line.
class SensorYaml {
 public:
  explicit SensorYaml(std::filesystem::path file) : file_(std::move(file)) {
    std::string text = read_file(file_);
    if (text.starts_with('%')) text.front() = '#';  // OpenCV's "%YAML:1.0" is not YAML
    try {
      root_ = YAML::Load(text);
    } catch (const YAML::Exception& e) {
      throw DatasetError(at_line(file_, e.mark.line + 1) + ": not YAML: " + e.msg);
    }
    if (!root_.IsMap()) throw DatasetError(file_.string() + ": no keys found");
  }

  YAML::Node at(const char* key) const { return child(root_, key); }

  YAML::Node child(const YAML::Node& map, const char* key) const {
    const YAML::Node node = map.IsMap() ? map[key] : YAML::Node(YAML::NodeType::Undefined);
    if (!node || node.IsNull()) throw DatasetError(file_.string() + ": key " + key + " is missing");
    return node;
  }

  std::string word(const char* key) const {
    const YAML::Node node = at(key);
    if (!node.IsScalar()) fail(node, std::string(key) + " is not a word");
    return node.Scalar();
  }

  // Positive and finite.
  double positive(const char* key) const {
    double value = 0.0;
    const YAML::Node node = at(key);
    if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value) || value <= 0.0)
      fail(node, std::string(key) + " is not a positive number");
    return value;
  }

  std::vector<double> numbers(const YAML::Node& node, const std::string& key, std::size_t count,
                              const char* meaning) const {
    std::vector<double> values;
    if (!node.IsSequence()) fail(node, key + " is not a list of numbers");
    if (node.size() != count)
      fail(node, key + " has " + std::to_string(node.size()) + " numbers, expected " +
                     std::to_string(count) + " (" + meaning + ')');
    for (const YAML::Node& element : node) {
      double value = 0.0;
      if (!YAML::convert<double>::decode(element, value) || !std::isfinite(value))
        fail(element, key + " holds something that is not a finite number");
      values.push_back(value);
    }
    return values;
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& problem) const {
    throw DatasetError(at_line(file_, node.Mark().line + 1) + ": " + problem);
  }

 private:
  std::filesystem::path file_;
  YAML::Node root_;
};

SE3 read_extrinsics(const SensorYaml& yaml) {
  const YAML::Node data = yaml.child(yaml.at("T_BS"), "data");
  const std::vector<double> values = yaml.numbers(data, "T_BS", 16, "4x4, row by row");
  const Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) yaml.fail(data, "T_BS: last row is not 0 0 0 1");

  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > kMaxNonOrthonormality)
    yaml.fail(data, "T_BS is not a rotation: |R R^T - I| = " + std::to_string(error) +
                        ", at most " + std::to_string(kMaxNonOrthonormality) + " is accepted");
  if (R.determinant() < 0.0) yaml.fail(data, "T_BS is a reflection: det R = -1");
  return make_pose(nearest_rotation(R), T.topRightCorner<3, 1>());
}

void require_model(const SensorYaml& yaml, const char* key, const std::string& model,
                   const std::string& alias) {
  const std::string found = yaml.word(key);
  if (found != model && found != alias)
    yaml.fail(yaml.at(key), std::string(key) + " '" + found + "' is not supported, only " + model);
}

PinholeCamera read_camera(const std::filesystem::path& file) {
  const SensorYaml yaml(file);
  require_model(yaml, "camera_model", "pinhole", "pinhole");
  require_model(yaml, "distortion_model", "radial-tangential", "radtan");

  PinholeCamera camera;
  const YAML::Node size = yaml.at("resolution");
  const auto resolution = yaml.numbers(size, "resolution", 2, "width and height");
  for (const double side : resolution)
    if (side < 1.0 || side > 65536.0 || side != std::floor(side))
      yaml.fail(size, "resolution: sides are whole numbers of pixels from 1 to 65536");
  camera.width = static_cast<int>(resolution[0]);
  camera.height = static_cast<int>(resolution[1]);

  const YAML::Node pinhole = yaml.at("intrinsics");
  const auto K = yaml.numbers(pinhole, "intrinsics", 4, "fu, fv, cu, cv");
  if (K[0] <= 0.0 || K[1] <= 0.0) yaml.fail(pinhole, "intrinsics: a focal length is not positive");
  camera.fx = K[0], camera.fy = K[1], camera.cx = K[2], camera.cy = K[3];

  const auto distortion = yaml.numbers(yaml.at("distortion_coefficients"),
                                       "distortion_coefficients", 4, "k1, k2, p1, p2");
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  camera.T_body_cam = read_extrinsics(yaml);
  return camera;
}

ImuNoise read_imu_noise(const SensorYaml& yaml) {
  return {.gyro_noise_density = yaml.positive("gyroscope_noise_density"),
          .gyro_random_walk = yaml.positive("gyroscope_random_walk"),
          .accel_noise_density = yaml.positive("accelerometer_noise_density"),
          .accel_random_walk = yaml.positive("accelerometer_random_walk"),
          .rate_hz = yaml.positive("rate_hz")};
}

}  // namespace

SensorRig read_euroc_rig(const std::filesystem::path& mav0) {
  SensorRig rig;
  const SensorYaml imu(mav0 / "imu0" / "sensor.yaml");
  rig.imu = read_imu_noise(imu);
  const SE3 T_imu_body = read_extrinsics(imu).inverse();  // `body` here: the one the files refer to
  const std::filesystem::path files[] = {mav0 / "cam0" / "sensor.yaml",
                                         mav0 / "cam1" / "sensor.yaml"};
  for (std::size_t i = 0; i < 2; ++i) {
    rig.stereo.cameras[i] = read_camera(files[i]);
    rig.stereo.cameras[i].T_body_cam = T_imu_body * rig.stereo.cameras[i].T_body_cam;
  }
  if (rig.stereo.baseline_m() < kMinBaseline_m)
    throw DatasetError(files[1].string() + ": T_BS puts the right camera where the left one is");
  return rig;
}

}  // namespace km
