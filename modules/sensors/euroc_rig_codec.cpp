#include "modules/sensors/euroc_rig_codec.hpp"

#include <yaml-cpp/yaml.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/config.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/lie.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

constexpr double kMaxNonOrthonormality = 1e-3;

// What calibrations of sensors say. Beyond, numbers overflow or lose their digits further on: the
// limits lie some orders of magnitude outside what is sold. Ring-laser gyroscopes have a noise of
// 3e-7 rad/s/sqrt(Hz), those of telephones 3e-4; simulators write smaller ones.
constexpr Bounds<double> kGyroNoise{1e-9, 1.0};    // [rad/s/sqrt(Hz)]
constexpr Bounds<double> kGyroWalk{1e-10, 1.0};    // [rad/s^2/sqrt(Hz)]
constexpr Bounds<double> kAccelNoise{1e-8, 10.0};  // [m/s^2/sqrt(Hz)]
constexpr Bounds<double> kAccelWalk{1e-10, 10.0};  // [m/s^3/sqrt(Hz)]
constexpr Bounds<double> kImuRate_hz{1.0, 1e5};
constexpr Bounds<double> kFocal_px{1.0, 1e6};
constexpr Bounds<double> kCenter_px{-1e6, 1e6};
constexpr Bounds<double> kDistortion{-1e3, 1e3};
constexpr Bounds<double> kLever_m{-1e3, 1e3};  // of a sensor on a robot
constexpr Bounds<double> kDepthScale_m{1e-6, 1.0};
constexpr Bounds<double> kDepthRange_m{1e-3, 1e4};
constexpr Bounds<double> kDepthBaseline_m{1e-3, 100.0};
constexpr double kMaxSide_px = 65536.0, kMaxArea_px = 1e8;

std::optional<double> finite_number(const YAML::Node& node) {
  double value = 0.0;
  if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

// One sensor.yaml of a EuRoC/ASL folder. Every getter throws DatasetError with file and line for
// what is missing or not what it should be.
class SensorYaml {
 public:
  explicit SensorYaml(std::filesystem::path file) : file_(std::move(file)) {
    std::string text = read_file(file_);
    if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
    if (text.starts_with('%')) text.front() = '#';  // OpenCV's "%YAML:1.0" is not YAML
    try {
      root_ = YAML::Load(text);
    } catch (const YAML::Exception& e) {
      throw DatasetError(at_line(file_, e.mark.line + 1) + ": not YAML: " + readable(e.msg));
    }
    if (!root_.IsMap()) throw DatasetError(file_.string() + ": no keys found");
  }

  [[nodiscard]] bool has(const char* key) const {
    const YAML::Node node = root_[key];
    return node && !node.IsNull();
  }

  [[nodiscard]] std::string word(const char* key) const {
    const YAML::Node node = child(root_, key);
    if (!node.IsScalar()) fail(node, std::string(key) + " is not a word");
    return node.Scalar();
  }

  // nullopt for what is not a number, infinite or not-a-number.
  [[nodiscard]] std::optional<double> number(const char* key) const {
    return finite_number(child(root_, key));
  }

  [[nodiscard]] double number(const char* key, const Bounds<double>& bounds) const {
    const std::optional<double> value = number(key);
    if (!value || !bounds.contains(*value))
      fail(key, std::string(key) + " is not a number within " + bounds.text());
    return *value;
  }

  // The same, or `otherwise` without the key.
  [[nodiscard]] double number(const char* key, const Bounds<double>& bounds,
                              double otherwise) const {
    return has(key) ? number(key, bounds) : otherwise;
  }

  // `count` finite numbers. `meaning` is said where there are not as many.
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t count,
                                            const char* meaning) const {
    return numbers(child(root_, key), key, count, meaning);
  }

  // T_BS, its rotation made exact; see read_euroc_rig() for what is refused.
  [[nodiscard]] SE3 extrinsics() const;

  // Refuses the value of a key that exists.
  [[noreturn]] void fail(const char* key, const std::string& problem) const {
    fail(child(root_, key), problem);
  }

 private:
  [[nodiscard]] YAML::Node child(const YAML::Node& map, const char* key) const {
    const YAML::Node node = map.IsMap() ? map[key] : YAML::Node(YAML::NodeType::Undefined);
    if (!node || node.IsNull()) throw DatasetError(file_.string() + ": key " + key + " is missing");
    return node;
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& problem) const {
    throw DatasetError(at_line(file_, node.Mark().line + 1) + ": " + readable(problem));
  }

  [[nodiscard]] std::vector<double> numbers(const YAML::Node& node, const std::string& key,
                                            std::size_t count, const char* meaning) const {
    if (!node.IsSequence()) fail(node, key + " is not a list of numbers");
    if (node.size() != count)
      fail(node, key + " has " + std::to_string(node.size()) + " numbers, expected " +
                     std::to_string(count) + " (" + meaning + ')');
    std::vector<double> values;
    for (const YAML::Node& element : node) {
      const std::optional<double> value = finite_number(element);
      if (!value) fail(element, key + " holds something that is not a finite number");
      values.push_back(*value);
    }
    return values;
  }

  std::filesystem::path file_;
  YAML::Node root_;
};

SE3 SensorYaml::extrinsics() const {
  const YAML::Node data = child(child(root_, "T_BS"), "data");
  const std::vector<double> values = numbers(data, "T_BS", 16, "4x4, row by row");
  const Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) fail(data, "T_BS: last row is not 0 0 0 1");

  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > kMaxNonOrthonormality)
    fail(data, "T_BS is not a rotation: |R R^T - I| = " + std::to_string(error) + ", at most " +
                   std::to_string(kMaxNonOrthonormality) + " is accepted");
  if (R.determinant() < 0.0) fail(data, "T_BS is a reflection: det R = -1");
  for (const double lever_m : T.topRightCorner<3, 1>())
    if (!kLever_m.contains(lever_m))
      fail(data,
           "T_BS: a translation of " + shortest_text(lever_m) + " m is outside " + kLever_m.text());
  return make_pose(nearest_rotation(R), T.topRightCorner<3, 1>());
}

constexpr double kMinBaseline_m = 1e-3;
constexpr double kDefaultDepthScale_m = 1e-3;
constexpr double kDefaultDepthBaseline_m = 0.1;
constexpr double kMaxMisalignment_m = 1e-3;   // of depth0 and cam0
constexpr double kMaxMisalignment_px = 0.05;  // of their intrinsics, and of their axes

void require_model(const SensorYaml& yaml, const char* key, const std::string& model,
                   const std::string& alias) {
  const std::string found = yaml.word(key);
  if (found != model && found != alias)
    yaml.fail(key, std::string(key) + " '" + found + "' is not supported, only " + model);
}

void read_resolution(const SensorYaml& yaml, Camera& camera) {
  const auto resolution = yaml.numbers("resolution", 2, "width and height");
  for (const double side : resolution)
    if (side < 1.0 || side > kMaxSide_px || side != std::floor(side))
      yaml.fail("resolution", "resolution: sides are whole numbers of pixels from 1 to 65536");
  if (resolution[0] * resolution[1] > kMaxArea_px)
    yaml.fail("resolution", "resolution: more than " + shortest_text(kMaxArea_px) + " pixels");
  camera.width = static_cast<int>(resolution[0]);
  camera.height = static_cast<int>(resolution[1]);
}

void read_intrinsics(const SensorYaml& yaml, Camera& camera) {
  const auto K = yaml.numbers("intrinsics", 4, "fu, fv, cu, cv");
  for (const std::size_t i : {0U, 1U})
    if (!kFocal_px.contains(K[i]))
      yaml.fail("intrinsics", "intrinsics: a focal length of " + shortest_text(K[i]) +
                                  " px is outside " + kFocal_px.text());
  for (const std::size_t i : {2U, 3U})
    if (!kCenter_px.contains(K[i]))
      yaml.fail("intrinsics", "intrinsics: a principal point at " + shortest_text(K[i]) +
                                  " px is outside " + kCenter_px.text());
  camera.fx = K[0], camera.fy = K[1], camera.cx = K[2], camera.cy = K[3];
}

void read_distortion(const SensorYaml& yaml, Camera& camera) {
  const auto distortion = yaml.numbers("distortion_coefficients", 4, "k1, k2, p1, p2");
  for (const double coefficient : distortion)
    if (!kDistortion.contains(coefficient))
      yaml.fail("distortion_coefficients",
                "distortion_coefficients: " + shortest_text(coefficient) + " is outside " +
                    kDistortion.text());
  camera.lens = Lens(LensModel::kRadialTangential, distortion);
}

Camera read_camera(const std::filesystem::path& file) {
  const SensorYaml yaml(file);
  require_model(yaml, "camera_model", "pinhole", "pinhole");
  require_model(yaml, "distortion_model", "radial-tangential", "radtan");
  Camera camera;
  read_resolution(yaml, camera);
  read_intrinsics(yaml, camera);
  read_distortion(yaml, camera);
  camera.T_body_cam = yaml.extrinsics();
  return camera;
}

ImuNoise read_imu_noise(const SensorYaml& yaml) {
  return {.gyro_noise_density = yaml.number("gyroscope_noise_density", kGyroNoise),
          .gyro_random_walk = yaml.number("gyroscope_random_walk", kGyroWalk),
          .accel_noise_density = yaml.number("accelerometer_noise_density", kAccelNoise),
          .accel_random_walk = yaml.number("accelerometer_random_walk", kAccelWalk),
          .rate_hz = yaml.number("rate_hz", kImuRate_hz)};
}

// Throws unless a depth pixel is the left pixel of the same place.
void check_alignment(const SensorYaml& yaml, const Camera& left) {
  Camera depth = left;
  read_resolution(yaml, depth);
  if (depth.width != left.width || depth.height != left.height)
    yaml.fail("resolution", "resolution: not that of cam0, " + std::to_string(left.width) + " x " +
                                std::to_string(left.height));
  read_intrinsics(yaml, depth);
  const Eigen::Vector4d off(depth.fx - left.fx, depth.fy - left.fy, depth.cx - left.cx,
                            depth.cy - left.cy);
  if (off.cwiseAbs().maxCoeff() > kMaxMisalignment_px)
    yaml.fail("intrinsics", "intrinsics: not those of cam0, with which depth must align");
  if (yaml.has("distortion_coefficients")) read_distortion(yaml, depth);
  if (depth.lens != left.lens)
    yaml.fail("distortion_coefficients",
              "distortion_coefficients: not those of cam0, with which depth must align");
  const SE3 T = left.T_body_cam.inverse() * yaml.extrinsics();
  const double turn_px = left.fx * (T.linear() - Eigen::Matrix3d::Identity()).norm();
  if (T.translation().norm() > kMaxMisalignment_m || turn_px > kMaxMisalignment_px)
    yaml.fail("T_BS", "T_BS: not that of cam0, with which depth must align");
}

DepthRange read_depth_range(const SensorYaml& yaml) {
  DepthRange range;
  range.max_m = yaml.number("max_range_m", kDepthRange_m, range.max_m);
  if (!yaml.has("min_range_m")) return range;
  const std::optional<double> min_m = yaml.number("min_range_m");
  if (!min_m || *min_m < 0.0 || *min_m >= range.max_m)
    yaml.fail("min_range_m", "min_range_m is not a number from 0 to below max_range_m");
  range.min_m = *min_m;
  return range;
}

StereoRig read_stereo(const std::filesystem::path& mav0, const Camera& left) {
  const std::filesystem::path file = mav0 / "cam1" / "sensor.yaml";
  if (!is_there(mav0 / "cam1"))
    throw DatasetError(file.string() + ": no such file (nor depth0, which RGB-D has instead)");
  const StereoRig stereo{{left, read_camera(file)}};
  if (stereo.baseline_m() < kMinBaseline_m)
    throw DatasetError(file.string() + ": T_BS puts the right camera where the left one is");
  return stereo;
}

}  // namespace

SensorRig read_euroc_rig(const std::filesystem::path& mav0, bool with_depth) {
  SensorRig rig;
  const SensorYaml imu(mav0 / "imu0" / "sensor.yaml");
  rig.imu = read_imu_noise(imu);
  const Camera left = read_camera(mav0 / "cam0" / "sensor.yaml");
  const bool rgbd = !is_there(mav0 / "cam1") && is_there(mav0 / "depth0");
  if (!rgbd) rig.stereo = read_stereo(mav0, left);
  if (rgbd || with_depth) {
    const SensorYaml depth(mav0 / "depth0" / "sensor.yaml");
    check_alignment(depth, left);
    rig.depth = read_depth_range(depth);
    if (rgbd)
      rig.stereo =
          rgbd_rig(left, depth.number("baseline_m", kDepthBaseline_m, kDefaultDepthBaseline_m));
  }
  const SE3 T_imu_body = imu.extrinsics().inverse();  // `body` here: the one the files refer to
  for (Camera& camera : rig.stereo.cameras) camera.T_body_cam = T_imu_body * camera.T_body_cam;
  return rig;
}

double read_depth_scale(const std::filesystem::path& mav0) {
  return SensorYaml(mav0 / "depth0" / "sensor.yaml")
      .number("depth_scale", kDepthScale_m, kDefaultDepthScale_m);
}

EurocReader open_euroc(const std::filesystem::path& folder, const EurocOptions& options) {
  const std::filesystem::path mav0 = find_mav0(folder);
  EurocCalibration calibration{.rig = read_euroc_rig(mav0, options.depth)};
  if (calibration.rig.depth) calibration.depth_scale_m = read_depth_scale(mav0);
  return EurocReader(folder, std::move(calibration), options);
}

}  // namespace km
