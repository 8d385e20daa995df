#include "modules/sensors/node/open_folder.hpp"

#include <utility>

#include "modules/core/camera/calibration_limits.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/sensors/node/calibration_map.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxMisalignment_m = 1e-3;   // between depth0 and cam0
constexpr double kMaxMisalignment_px = 0.05;  // by the intrinsics, and by the directions of axes
constexpr const char* kCoefficients = "distortion_coefficients";

CalibrationMap sensor_yaml(const fs::path& mav0, const char* sensor) {
  const fs::path file = mav0 / sensor / "sensor.yaml";
  if (is_absent(file))
    throw DatasetError(file.string() + ": no such file: a EuRoC folder has the calibration of " +
                       sensor + " there, beside data.csv (see apps/robot/recording.md)");
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

// The keys of a depth camera; those that are missing leave `depth` as it is.
void read_depth_keys(const CalibrationMap& yaml, DepthCamera& depth) {
  depth.depth_scale_m = yaml.number("depth_scale", kDepthScale_m, depth.depth_scale_m);
  depth.range = read_depth_range(yaml, depth.range.max_m);
  depth.baseline_m = yaml.number("baseline_m", kDepthBaseline_m, depth.baseline_m);
}

DepthCamera depth_camera_of(const fs::path& folder, const fs::path& file) {
  if (!file.empty()) {
    const CalibrationMap yaml(file);
    DepthCamera result{.camera = read_camera(yaml, kCoefficients),
                       .depth_scale_m = 1.0 / 5000.0,
                       .range = {0.0, kStructuredLightRange_m}};
    read_depth_keys(yaml, result);
    return result;
  }
  if (auto known = tum_camera(folder)) return *std::move(known);
  throw DatasetError(folder.string() +
                     ": a folder in TUM's layout has no calibration: name it after its camera "
                     "(freiburg1, freiburg2 or freiburg3 in its name), or describe the camera by "
                     "--rig FILE (see apps/robot/recording.md)");
}

}  // namespace

RigCalibration read_euroc_calibration(const fs::path& mav0, const RigChoice& choice) {
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

SensorRig read_euroc_rig(const fs::path& mav0, bool with_depth) {
  const bool has_right = is_there(mav0 / "cam1");
  const bool is_rgbd = !has_right && is_there(mav0 / "depth0");
  RigChoice choice;
  if (is_rgbd || with_depth) {
    const CalibrationMap yaml = sensor_yaml(mav0, "depth0");
    check_alignment(yaml, read_euroc_camera(sensor_yaml(mav0, "cam0")));
    DepthCamera depth;
    read_depth_keys(yaml, depth);
    choice.depth = DepthChoice{depth.range, depth.baseline_m};
  }
  if (is_rgbd) choice.right.reset();
  if (!has_right && !is_rgbd)
    throw DatasetError((mav0 / "cam1" / "sensor.yaml").string() +
                       ": no such file, nor depth0 of an RGB-D camera: "
                       "one camera without depth is not supported");
  return read_euroc_calibration(mav0, choice).rig;
}

double read_depth_baseline_m(const fs::path& mav0) {
  return sensor_yaml(mav0, "depth0")
      .number("baseline_m", kDepthBaseline_m, DepthCamera().baseline_m);
}

double read_depth_scale(const fs::path& mav0) {
  return sensor_yaml(mav0, "depth0")
      .number("depth_scale", kDepthScale_m, DepthCamera().depth_scale_m);
}

ImageFolder read_folder(const fs::path& folder, const FolderOptions& options,
                        const fs::path& camera_file) {
  const FolderLayout layout = layout_of(folder);
  if (layout == FolderLayout::kEuroc) {
    const fs::path mav0 = find_mav0(folder);
    SensorRig rig = read_euroc_rig(mav0, options.depth);
    rig.has_imu &= options.imu;
    options.correction.apply_to(rig.stereo);
    const double scale_m = rig.depth ? read_depth_scale(mav0) : 0.0;
    return list_euroc_folder(mav0, std::move(rig), scale_m, options);
  }
  if (options.labels)
    throw DatasetError(folder.string() + ": " + to_string(layout) + " has no label images");
  if (layout == FolderLayout::kTum)
    return read_tum_folder(folder, depth_camera_of(folder, camera_file));
  if (!camera_file.empty())
    throw DatasetError(camera_file.string() + ": not for " + to_string(layout) +
                       ", which has its calibration: leave --rig out");
  return layout == FolderLayout::kKitti ? read_kitti_folder(folder)
                                        : read_seven_scenes_folder(folder);
}

FolderReader open_folder(const fs::path& folder, const FolderOptions& options,
                         const fs::path& camera_file) {
  return {read_folder(folder, options, camera_file), options.part};
}

}  // namespace km
