#include "modules/sensors/node/euroc_rig.hpp"

#include "modules/core/calibration_limits.hpp"
#include "modules/core/input_file.hpp"
#include "modules/sensors/node/read_camera.hpp"

namespace km {
namespace {

constexpr double kDefaultDepthScale_m = 1e-3;
constexpr double kDefaultDepthBaseline_m = 0.1;
constexpr double kMaxMisalignment_m = 1e-3;   // between depth0 and cam0
constexpr double kMaxMisalignment_px = 0.05;  // by the intrinsics, and by the directions of axes
constexpr const char* kCoefficients = "distortion_coefficients";

CalibrationMap sensor_yaml(const std::filesystem::path& mav0, const char* sensor) {
  const std::filesystem::path file = mav0 / sensor / "sensor.yaml";
  if (is_absent(file))
    throw DatasetError(file.string() + ": no such file: a EuRoC folder has the calibration of " +
                       sensor + " there, beside data.csv (see Inputs in apps/robot/README.md)");
  return CalibrationMap(file);
}

SE3 extrinsics(const CalibrationMap& yaml) {
  return yaml.map("T_BS").transform("data", "T_BS");
}

Camera read_euroc_camera(const CalibrationMap& yaml) {
  Camera camera = read_camera(yaml, kCoefficients);
  camera.T_body_cam = extrinsics(yaml);
  return camera;
}

ImuNoise read_imu_noise(const CalibrationMap& yaml) {
  return {.gyro_noise_density = yaml.number("gyroscope_noise_density", kGyroNoise),
          .gyro_random_walk = yaml.number("gyroscope_random_walk", kGyroWalk),
          .accel_noise_density = yaml.number("accelerometer_noise_density", kAccelNoise),
          .accel_random_walk = yaml.number("accelerometer_random_walk", kAccelWalk),
          .rate_hz = yaml.number("rate_hz", kImuRate_hz)};
}

// Throws unless a pixel of the depth image and the same pixel of the left image see the same point.
// A file without distortion describes a pinhole with the distortion of cam0.
void check_alignment(const CalibrationMap& yaml, const Camera& left) {
  Camera depth = left;
  if (yaml.has(kCoefficients))
    depth = read_camera(yaml, kCoefficients);
  else
    read_pinhole(yaml, depth);
  if (depth.width != left.width || depth.height != left.height)
    yaml.fail("resolution", "resolution: not that of cam0, " + std::to_string(left.width) + " x " +
                                std::to_string(left.height));
  const Eigen::Vector4d off(depth.fx - left.fx, depth.fy - left.fy, depth.cx - left.cx,
                            depth.cy - left.cy);
  if (off.cwiseAbs().maxCoeff() > kMaxMisalignment_px)
    yaml.fail("intrinsics", "intrinsics: not those of cam0, with which depth must align");
  if (depth.lens != left.lens)
    yaml.fail(kCoefficients,
              "distortion_coefficients: not those of cam0, with which depth must align");
  const SE3 T = left.T_body_cam.inverse() * extrinsics(yaml);
  const double turn_px = left.fx * (T.linear() - Eigen::Matrix3d::Identity()).norm();
  if (T.translation().norm() > kMaxMisalignment_m || turn_px > kMaxMisalignment_px)
    yaml.fail("T_BS", "T_BS: not that of cam0, with which depth must align");
}

// Moves the cameras from the reference frame of the files to the inertial sensor's frame.
void move_to_imu(const CalibrationMap& imu, StereoRig& stereo) {
  const SE3 T_imu_reference = extrinsics(imu).inverse();
  for (Camera& camera : stereo.cameras) camera.T_body_cam = T_imu_reference * camera.T_body_cam;
}

StereoRig read_stereo(const std::filesystem::path& mav0, const Camera& left) {
  const std::filesystem::path file = mav0 / "cam1" / "sensor.yaml";
  if (!is_there(mav0 / "cam1"))
    throw DatasetError(file.string() +
                       ": no such file, nor depth0 of an RGB-D camera: "
                       "one camera without depth is not supported");
  const CalibrationMap yaml(file);
  const StereoRig stereo{{left, read_euroc_camera(yaml)}};
  if (const auto problem = pair_problem(stereo)) yaml.fail("T_BS", "T_BS " + *problem);
  return stereo;
}

}  // namespace

SensorRig read_euroc_rig(const std::filesystem::path& mav0, bool with_depth) {
  SensorRig rig;
  const Camera left = read_euroc_camera(sensor_yaml(mav0, "cam0"));
  const bool rgbd = !is_there(mav0 / "cam1") && is_there(mav0 / "depth0");
  if (!rgbd) rig.stereo = read_stereo(mav0, left);
  if (rgbd || with_depth) {
    const CalibrationMap depth = sensor_yaml(mav0, "depth0");
    check_alignment(depth, left);
    rig.depth = read_depth_range(depth, DepthRange().max_m);
    if (rgbd)
      rig.stereo =
          rgbd_rig(left, depth.number("baseline_m", kDepthBaseline_m, kDefaultDepthBaseline_m));
  }
  rig.has_imu = is_there(mav0 / "imu0");
  if (!rig.has_imu) return rig;
  const CalibrationMap imu = sensor_yaml(mav0, "imu0");
  rig.imu = read_imu_noise(imu);
  move_to_imu(imu, rig.stereo);
  return rig;
}

RigCalibration read_euroc_calibration(const std::filesystem::path& mav0, const RigChoice& choice) {
  RigCalibration calibration;
  calibration.rig.has_imu = is_there(mav0 / "imu0");
  const auto camera = [&mav0](std::size_t index) {
    return sensor_yaml(mav0, ("cam" + std::to_string(index)).c_str());
  };
  std::optional<Camera> right;
  if (choice.right) right = read_euroc_camera(camera(*choice.right));
  if (const auto problem =
          join_cameras(read_euroc_camera(camera(choice.left)), right, choice, calibration.rig))
    camera(*choice.right).fail("T_BS", "T_BS " + *problem);
  if (!calibration.rig.has_imu) return calibration;
  const CalibrationMap imu = sensor_yaml(mav0, "imu0");
  calibration.rig.imu = read_imu_noise(imu);
  move_to_imu(imu, calibration.rig.stereo);
  return calibration;
}

double read_depth_scale(const std::filesystem::path& mav0) {
  return sensor_yaml(mav0, "depth0").number("depth_scale", kDepthScale_m, kDefaultDepthScale_m);
}

EurocReader open_euroc(const std::filesystem::path& folder, const EurocOptions& options) {
  const std::filesystem::path mav0 = find_mav0(folder);
  EurocCalibration calibration{.rig = read_euroc_rig(mav0, options.depth)};
  calibration.rig.has_imu &= options.imu;
  options.correction.apply_to(calibration.rig.stereo);
  if (calibration.rig.depth) calibration.depth_scale_m = read_depth_scale(mav0);
  return EurocReader(folder, std::move(calibration), options);
}

}  // namespace km
