#include <algorithm>

#include "modules/core/calibration_limits.hpp"
#include "modules/sensors/node/calibration_map.hpp"
#include "modules/sensors/node/rig_calibration.hpp"

namespace km {
namespace {

constexpr double kMaxNormError = 1e-3;  // norm of a quaternion

constexpr Bounds<double> kAnything{-1e300, 1e300};

std::vector<double> values_of(const CalibrationMap& map, std::initializer_list<const char*> keys) {
  std::vector<double> values;
  for (const char* key : keys) values.push_back(map.number(key, kAnything));
  return values;
}

// The lens of a camera_type, and the factor that converts its focal lengths to those of Camera.
struct TypedLens {
  Lens lens;
  double focal_factor = 1.0;
};

TypedLens read_lens(const CalibrationMap& camera, const CalibrationMap& k) {
  const std::string type = camera.word("camera_type");
  const auto lens = [&](LensModel model, const std::vector<double>& coefficients) {
    return lens_of(camera, "camera_type", model, coefficients);
  };
  if (type == "pinhole") return {};
  if (type == "pinhole-radtan8")
    return {lens(LensModel::kRadialTangential,
                 values_of(k, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}))};
  if (type == "kb4") return {lens(LensModel::kEquidistant, values_of(k, {"k1", "k2", "k3", "k4"}))};
  if (type == "ds") {
    const std::vector<double> values = values_of(k, {"xi", "alpha"});
    return {lens(LensModel::kDoubleSphere, values), 1.0 / (1.0 + values[0])};
  }
  if (type == "ucm") {
    // x / (alpha d + (1 - alpha) z) is Mei's model with xi = alpha / (1 - alpha) and unit
    // magnification on the axis.
    const double alpha = k.number("alpha", {0.0, 0.99});
    return {lens(LensModel::kOmnidirectional, {alpha / (1.0 - alpha), 0.0, 0.0, 0.0, 0.0})};
  }
  camera.fail("camera_type", "camera_type '" + type +
                                 "' is not supported, only pinhole, pinhole-radtan8, kb4, ds and "
                                 "ucm");
}

SE3 read_pose(const CalibrationMap& pose) {
  const std::vector<double> q = values_of(pose, {"qx", "qy", "qz", "qw"});
  const std::vector<double> p = values_of(pose, {"px", "py", "pz"});
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (!(std::abs(rotation.norm() - 1.0) < kMaxNormError))
    pose.fail("qx", "T_imu_cam: a quaternion of norm " + shortest_text(rotation.norm()));
  const SE3 T = make_pose(rotation.normalized().toRotationMatrix(), {p[0], p[1], p[2]});
  if (const auto problem = transform_problem(T.matrix())) pose.fail("px", "T_imu_cam" + *problem);
  return T;
}

Camera read_basalt_camera(const CalibrationMap& root, std::size_t index) {
  const std::vector<CalibrationMap> cameras = root.maps("intrinsics");
  const std::vector<CalibrationMap> poses = root.maps("T_imu_cam");
  const std::vector<std::vector<double>> resolutions = root.lists("resolution");
  if (poses.size() != cameras.size() || resolutions.size() != cameras.size())
    root.fail("intrinsics", "intrinsics of " + std::to_string(cameras.size()) +
                                " cameras, but T_imu_cam of " + std::to_string(poses.size()) +
                                " and resolution of " + std::to_string(resolutions.size()));
  const std::vector<double>& size = resolutions[index];
  if (size.size() != 2) root.fail("resolution", "resolution: not a width and a height");
  if (const auto problem = resolution_problem(size[0], size[1]))
    root.fail("resolution", "resolution: " + *problem);
  Camera camera;
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  const CalibrationMap k = cameras[index].map("intrinsics");
  const std::vector<double> K = values_of(k, {"fx", "fy", "cx", "cy"});
  camera.fx = K[0], camera.fy = K[1], camera.cx = K[2], camera.cy = K[3];
  check_intrinsics(k, "fx", camera);
  const TypedLens typed = read_lens(cameras[index], k);
  camera.lens = typed.lens;
  camera.fx *= typed.focal_factor;
  camera.fy *= typed.focal_factor;
  camera.T_body_cam = read_pose(poses[index]);
  return camera;
}

// A number, or the largest of the numbers of the three axes.
double read_noise(const CalibrationMap& root, const char* key, const Bounds<double>& bounds) {
  if (root.is_list(key)) {
    const std::vector<double> axes = root.numbers(key, 3, "of x, y and z");
    const double largest = *std::max_element(axes.begin(), axes.end());
    if (bounds.contains(largest)) return largest;
  }
  return root.number(key, bounds);
}

void note_biases(const CalibrationMap& root, RigCalibration& calibration) {
  for (const char* key : {"calib_accel_bias", "calib_gyro_bias"}) {
    if (!root.has(key)) continue;
    const std::vector<double> values = root.numbers(key);
    if (std::any_of(values.begin(), values.end(), [](double value) { return value != 0.0; }))
      calibration.notes.push_back(root.place_of(key) + ": " + key + " is not applied to samples");
  }
}

}  // namespace

RigCalibration read_basalt(const CalibrationMap& map, const RigChoice& choice) {
  const CalibrationMap root = map.map("value0");
  const std::size_t count = root.maps("intrinsics").size();
  const std::size_t last = std::max(choice.left, choice.right.value_or(choice.left));
  if (last >= count)
    root.fail("intrinsics", "intrinsics: no camera " + std::to_string(last) + " among " +
                                std::to_string(count) +
                                (count == 1 ? ": one camera without depth is not supported" : ""));
  RigCalibration calibration;
  std::optional<Camera> right;
  if (choice.right) right = read_basalt_camera(root, *choice.right);
  if (const auto problem =
          join_cameras(read_basalt_camera(root, choice.left), right, choice, calibration.rig))
    root.fail("T_imu_cam", "T_imu_cam " + *problem);
  calibration.rig.imu = {.gyro_noise_density = read_noise(root, "gyro_noise_std", kGyroNoise),
                         .gyro_random_walk = read_noise(root, "gyro_bias_std", kGyroWalk),
                         .accel_noise_density = read_noise(root, "accel_noise_std", kAccelNoise),
                         .accel_random_walk = read_noise(root, "accel_bias_std", kAccelWalk),
                         .rate_hz = root.number("imu_update_rate", kImuRate_hz)};
  if (root.has("cam_time_offset_ns"))
    calibration.image_time_offset_s =
        1e-9 *
        root.number("cam_time_offset_ns", {1e9 * kTimeOffset_s.min, 1e9 * kTimeOffset_s.max});
  note_biases(root, calibration);
  return calibration;
}

}  // namespace km
