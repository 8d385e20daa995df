#include "modules/sensors/euroc_rig.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/sensor_yaml.hpp"

namespace km {
namespace {

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

void read_resolution(const SensorYaml& yaml, PinholeCamera& camera) {
  const auto resolution = yaml.numbers("resolution", 2, "width and height");
  for (const double side : resolution)
    if (side < 1.0 || side > 65536.0 || side != std::floor(side))
      yaml.fail("resolution", "resolution: sides are whole numbers of pixels from 1 to 65536");
  camera.width = static_cast<int>(resolution[0]);
  camera.height = static_cast<int>(resolution[1]);
}

void read_intrinsics(const SensorYaml& yaml, PinholeCamera& camera) {
  const auto K = yaml.numbers("intrinsics", 4, "fu, fv, cu, cv");
  if (K[0] <= 0.0 || K[1] <= 0.0)
    yaml.fail("intrinsics", "intrinsics: a focal length is not positive");
  camera.fx = K[0], camera.fy = K[1], camera.cx = K[2], camera.cy = K[3];
}

void read_distortion(const SensorYaml& yaml, PinholeCamera& camera) {
  const auto distortion = yaml.numbers("distortion_coefficients", 4, "k1, k2, p1, p2");
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
}

PinholeCamera read_camera(const std::filesystem::path& file) {
  const SensorYaml yaml(file);
  require_model(yaml, "camera_model", "pinhole", "pinhole");
  require_model(yaml, "distortion_model", "radial-tangential", "radtan");
  PinholeCamera camera;
  read_resolution(yaml, camera);
  read_intrinsics(yaml, camera);
  read_distortion(yaml, camera);
  camera.T_body_cam = yaml.extrinsics();
  return camera;
}

ImuNoise read_imu_noise(const SensorYaml& yaml) {
  return {.gyro_noise_density = yaml.positive("gyroscope_noise_density"),
          .gyro_random_walk = yaml.positive("gyroscope_random_walk"),
          .accel_noise_density = yaml.positive("accelerometer_noise_density"),
          .accel_random_walk = yaml.positive("accelerometer_random_walk"),
          .rate_hz = yaml.positive("rate_hz")};
}

// Throws unless a depth pixel is the left pixel of the same place.
void check_alignment(const SensorYaml& yaml, const PinholeCamera& left) {
  PinholeCamera depth = left;
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
  if (depth.distortion != left.distortion)
    yaml.fail("distortion_coefficients",
              "distortion_coefficients: not those of cam0, with which depth must align");
  const SE3 T = left.T_body_cam.inverse() * yaml.extrinsics();
  const double turn_px = left.fx * (T.linear() - Eigen::Matrix3d::Identity()).norm();
  if (T.translation().norm() > kMaxMisalignment_m || turn_px > kMaxMisalignment_px)
    yaml.fail("T_BS", "T_BS: not that of cam0, with which depth must align");
}

DepthRange read_depth_range(const SensorYaml& yaml) {
  DepthRange range;
  range.max_m = yaml.positive("max_range_m", range.max_m);
  if (!yaml.has("min_range_m")) return range;
  const std::optional<double> min_m = yaml.number("min_range_m");
  if (!min_m || *min_m < 0.0 || *min_m >= range.max_m)
    yaml.fail("min_range_m", "min_range_m is not a number from 0 to below max_range_m");
  range.min_m = *min_m;
  return range;
}

StereoRig read_stereo(const std::filesystem::path& mav0, const PinholeCamera& left) {
  const std::filesystem::path file = mav0 / "cam1" / "sensor.yaml";
  if (!std::filesystem::exists(mav0 / "cam1"))
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
  const PinholeCamera left = read_camera(mav0 / "cam0" / "sensor.yaml");
  const bool rgbd =
      !std::filesystem::exists(mav0 / "cam1") && std::filesystem::exists(mav0 / "depth0");
  if (!rgbd) rig.stereo = read_stereo(mav0, left);
  if (rgbd || with_depth) {
    const SensorYaml depth(mav0 / "depth0" / "sensor.yaml");
    check_alignment(depth, left);
    rig.depth = read_depth_range(depth);
    if (rgbd) rig.stereo = rgbd_rig(left, depth.positive("baseline_m", kDefaultDepthBaseline_m));
  }
  const SE3 T_imu_body = imu.extrinsics().inverse();  // `body` here: the one the files refer to
  for (PinholeCamera& camera : rig.stereo.cameras)
    camera.T_body_cam = T_imu_body * camera.T_body_cam;
  return rig;
}

double read_depth_scale(const std::filesystem::path& mav0) {
  return SensorYaml(mav0 / "depth0" / "sensor.yaml").positive("depth_scale", kDefaultDepthScale_m);
}

}  // namespace km
