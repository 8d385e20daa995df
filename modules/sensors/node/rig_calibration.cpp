#include "modules/sensors/node/rig_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "modules/core/camera/calibration_limits.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/recordings/ros_camera.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/node/open_folder.hpp"

namespace km {
namespace {

constexpr double kMaxShiftDifference_s = 1e-3;

std::string camera_name(std::size_t index) {
  return "cam" + std::to_string(index);
}

bool is_flat_imu(const CalibrationMap& map) {
  return map.first_of({"gyroscope_noise_density", "accelerometer_noise_density"}) != nullptr;
}

// The maps of cameras and of the inertial sensor, perhaps from one file.
struct Chains {
  std::optional<CalibrationMap> cameras;
  std::optional<CalibrationMap> imu;  // the map of imu0

  void add(const CalibrationMap& map) {
    const std::filesystem::path& file = map.file();
    const bool has_cameras = map.has("cam0");
    const bool has_imu = map.has("imu0") || is_flat_imu(map);
    if (!has_cameras && !has_imu)
      throw DatasetError(file.string() +
                         ": neither cam0 nor imu0 with indented keys nor the noise of an inertial "
                         "sensor: not a file of Kalibr");
    if ((has_cameras && cameras) || (has_imu && imu))
      throw DatasetError(file.string() + ": a second file of " + (has_imu ? "imu0" : "cam0"));
    if (has_cameras) cameras.emplace(map);
    if (has_imu) imu.emplace(map.has("imu0") ? map.map("imu0") : map);
  }
};

// T_cam_imu of camera `index`, stated directly or through the cameras before it.
SE3 read_T_cam_imu(const CalibrationMap& chain, std::size_t index) {
  const CalibrationMap camera = chain.map(camera_name(index).c_str());
  if (camera.has("T_cam_imu")) return camera.transform("T_cam_imu", "T_cam_imu");
  if (camera.has("T_imu_cam")) return camera.transform("T_imu_cam", "T_imu_cam").inverse();
  if (index == 0 || !camera.has("T_cn_cnm1"))
    camera.fail("T_cam_imu", camera_name(index) +
                                 ": key T_cam_imu is missing (or T_imu_cam, of OpenVINS): "
                                 "calibrate the cameras together with the inertial sensor");
  return camera.transform("T_cn_cnm1", "T_cn_cnm1") * read_T_cam_imu(chain, index - 1);
}

// T_cam_cam0 of camera `index`, through the cameras before it.
SE3 read_T_cam_cam0(const CalibrationMap& chain, std::size_t index) {
  if (index == 0) return SE3::Identity();
  const CalibrationMap camera = chain.map(camera_name(index).c_str());
  return camera.transform("T_cn_cnm1", "T_cn_cnm1") * read_T_cam_cam0(chain, index - 1);
}

// False if the cameras were calibrated without the inertial sensor.
bool has_extrinsics(const CalibrationMap& chain, std::size_t index) {
  const CalibrationMap camera = chain.map(camera_name(index).c_str());
  if (camera.first_of({"T_cam_imu", "T_imu_cam"}) != nullptr) return true;
  return index > 0 && has_extrinsics(chain, index - 1);
}

// False if the map states only poses of the camera.
bool has_lens(const CalibrationMap& camera) {
  return camera.first_of({"camera_model", "intrinsics", "resolution", "distortion_model",
                          "distortion_coeffs"}) != nullptr;
}

Camera read_chain_camera(const CalibrationMap& chain, std::size_t index) {
  return read_camera(chain.map(camera_name(index).c_str()), "distortion_coeffs");
}

// Sets T_body_cam of the cameras. Unless `has_extrinsics`, they are poses in the left camera's
// frame.
void read_poses(const CalibrationMap& chain, const RigChoice& choice, Camera& left,
                std::optional<Camera>& right, bool has_extrinsics) {
  if (has_extrinsics) {
    left.T_body_cam = read_T_cam_imu(chain, choice.left).inverse();
    if (right) right->T_body_cam = read_T_cam_imu(chain, *choice.right).inverse();
  } else if (right) {
    right->T_body_cam =
        read_T_cam_cam0(chain, choice.left) * read_T_cam_cam0(chain, *choice.right).inverse();
  }
}

std::string read_topic(const CalibrationMap& map) {
  return map.has("rostopic") ? map.word("rostopic") : std::string();
}

std::optional<double> read_time_shift(const CalibrationMap& camera) {
  if (!camera.has("timeshift_cam_imu")) return std::nullopt;
  return camera.number("timeshift_cam_imu", kTimeOffset_s);
}

// Time shift of the pair, whose images are taken at the same time. The difference of the two shifts
// is noise of the calibration.
std::optional<double> read_pair_shift(const CalibrationMap& left, const CalibrationMap& right) {
  const auto a = read_time_shift(left), b = read_time_shift(right);
  if (!a || !b) return a ? a : b;
  if (std::abs(*a - *b) > kMaxShiftDifference_s)
    right.fail("timeshift_cam_imu",
               "timeshift_cam_imu: " + shortest_text(*b) + " s, but " + shortest_text(*a) +
                   " s of the left camera: the images of the pair are not taken at one time");
  return 0.5 * (*a + *b);
}

void read_imu(const CalibrationMap& imu, RigCalibration& calibration) {
  calibration.rig.imu = {
      .gyro_noise_density = imu.number("gyroscope_noise_density", kGyroNoise),
      .gyro_random_walk = imu.number("gyroscope_random_walk", kGyroWalk),
      .accel_noise_density = imu.number("accelerometer_noise_density", kAccelNoise),
      .accel_random_walk = imu.number("accelerometer_random_walk", kAccelWalk),
      .rate_hz = imu.number("update_rate", kImuRate_hz)};
  calibration.imu_topic = read_topic(imu);
  if (imu.has("T_i_b") && !imu.transform("T_i_b", "T_i_b").isApprox(SE3::Identity(), 1e-6))
    imu.fail("T_i_b", "T_i_b: not the identity; the reference of a Kalibr rig is imu0 itself");
  // Notes on scales and axes of the inertial sensor, which are not used. The keys are those of
  // Kalibr's extended models and of OpenVINS.
  for (const char* key : {"gyroscopes", "accelerometers"})
    if (imu.has(key))
      calibration.notes.push_back(imu.place_of(key) + ": " + key + " are not applied to samples");
  for (const char* key : {"Tw", "Ta"})
    if (imu.has(key) && imu.numbers(key) != std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1})
      calibration.notes.push_back(imu.place_of(key) + ": " + key + " is not applied to samples");
}

// Sets the poses of cameras that topics describe.
void read_poses_alone(const CalibrationMap& chain, const RigChoice& choice,
                      RigCalibration& calibration) {
  auto& cameras = calibration.rig.stereo.cameras;
  std::optional<Camera> right;
  calibration.has_pair = false;
  if (choice.right && chain.has(camera_name(*choice.right).c_str())) {
    const CalibrationMap map = chain.map(camera_name(*choice.right).c_str());
    calibration.has_pair = map.first_of({"T_cam_imu", "T_imu_cam", "T_cn_cnm1"}) != nullptr;
    if (calibration.has_pair) right.emplace();
  }
  read_poses(chain, choice, cameras[0], right, calibration.has_extrinsics);
  if (right) cameras[1].T_body_cam = right->T_body_cam;
}

void read_cameras(const CalibrationMap& chain, const RigChoice& choice,
                  RigCalibration& calibration) {
  const CalibrationMap left_map = chain.map(camera_name(choice.left).c_str());
  calibration.image_topics[0] = read_topic(left_map);
  calibration.image_time_offset_s = read_time_shift(left_map);
  calibration.has_extrinsics = !choice.may_be_partial || has_extrinsics(chain, choice.left);
  const std::string right_name = camera_name(choice.right.value_or(0));
  const bool has_right = choice.right && chain.has(right_name.c_str());
  calibration.has_cameras = !choice.may_be_partial || has_lens(left_map) ||
                            (has_right && has_lens(chain.map(right_name.c_str())));
  if (!calibration.has_cameras) return read_poses_alone(chain, choice, calibration);
  calibration.has_pair = true;
  Camera left = read_chain_camera(chain, choice.left);
  std::optional<Camera> right;
  if (choice.right) {
    if (!has_right)
      throw DatasetError(chain.file().string() + ": no " + right_name +
                         ": one camera without depth is not supported");
    right = read_chain_camera(chain, *choice.right);
  }
  read_poses(chain, choice, left, right, calibration.has_extrinsics);
  const auto problem = join_cameras(left, right, choice, calibration.rig);
  if (!choice.right) return;
  const CalibrationMap right_map = chain.map(right_name.c_str());
  if (problem)
    right_map.fail(right_map.first_of({"T_cam_imu", "T_imu_cam", "T_cn_cnm1"}),
                   right_name + ' ' + *problem);
  calibration.image_topics[1] = read_topic(right_map);
  calibration.image_time_offset_s = read_pair_shift(left_map, right_map);
}

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
  if (type == "eucm") {
    const std::vector<double> values = values_of(k, {"alpha", "beta"});
    return {lens(LensModel::kDoubleSphere, {0.0, values[0], values[1]})};
  }
  if (type == "ucm") return {lens(LensModel::kDoubleSphere, {0.0, values_of(k, {"alpha"})[0]})};
  camera.fail("camera_type", "camera_type '" + type +
                                 "' is not supported, only pinhole, pinhole-radtan8, kb4, ds, "
                                 "eucm and ucm");
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

constexpr const char* kExpected =
    "expected a folder with sensor.yaml of cam0, cam1 and imu0 (EuRoC), one or two YAML files of "
    "Kalibr with cam0, cam1 and imu0, a JSON file of Basalt with value0, or a file of ROS' "
    "camera_calibration with camera_matrix for each camera";

// A file of ROS' camera_calibration as the message that drivers make of it.
RosCameraInfo read_camera_info(const CalibrationMap& map) {
  constexpr Bounds<double> kSide_px{1.0, 65536.0};
  RosCameraInfo info;
  info.header.frame_id = map.file().filename().string();
  info.width = static_cast<std::uint32_t>(map.number("image_width", kSide_px));
  info.height = static_cast<std::uint32_t>(map.number("image_height", kSide_px));
  info.distortion_model = map.word("distortion_model");
  info.d = map.map("distortion_coefficients").numbers("data");
  const auto read = [&map](const char* key, auto& matrix) {
    if (map.has(key))
      std::ranges::copy(map.map(key).numbers("data", matrix.size(), key), matrix.begin());
  };
  read("camera_matrix", info.k);
  read("rectification_matrix", info.r);
  read("projection_matrix", info.p);
  return info;
}

RigCalibration read_camera_infos(const std::vector<CalibrationMap>& maps, const RigChoice& choice) {
  const std::string name = maps.front().file().string();
  if (maps.size() != (choice.right ? 2U : 1U))
    throw DatasetError(name + ": name one file of ROS' camera_calibration for each camera");
  if (!choice.may_be_partial)
    throw DatasetError(name + ": has no pose on the body: name it in a rig file");
  RigCalibration calibration;
  calibration.has_extrinsics = false;
  calibration.notes.push_back(name + ": noise figures are those of EuRoC's inertial sensor");
  const RosImages images = choice.rectified ? RosImages::kRectified : RosImages::kRaw;
  try {
    const RosCameraInfo left = read_camera_info(maps.front());
    std::optional<Camera> right;
    if (choice.right) {
      const RosCameraInfo info = read_camera_info(maps.back());
      const auto distance_m = baseline_m(info);
      if (!distance_m)
        maps.back().fail("projection_matrix",
                         "projection_matrix: no baseline: fourth number is to be -fx B");
      right = camera_of(info, images);
      right->T_body_cam = T_frame_camera(left, images).inverse() *
                          make_pose(Eigen::Matrix3d::Identity(), {*distance_m, 0.0, 0.0}) *
                          T_frame_camera(info, images);
    }
    if (const auto problem = join_cameras(camera_of(left, images), right, choice, calibration.rig))
      throw DatasetError(maps.back().file().string() + ": " + *problem);
  } catch (const std::invalid_argument& error) {
    throw DatasetError(name + ": " + error.what());
  }
  return calibration;
}

RigCalibration read_kalibr(const std::vector<CalibrationMap>& maps, const RigChoice& choice) {
  Chains chains;
  for (const CalibrationMap& map : maps) chains.add(map);
  RigCalibration calibration;
  calibration.has_cameras = calibration.has_extrinsics = calibration.has_pair = false;
  if (choice.depth) calibration.rig.depth = choice.depth->range;
  if (!chains.cameras && !choice.may_be_partial)
    throw DatasetError(maps.front().file().string() +
                       ": no cam0; also name Kalibr's chain of cameras");
  if (chains.cameras) read_cameras(*chains.cameras, choice, calibration);
  if (chains.imu)
    read_imu(*chains.imu, calibration);
  else
    calibration.notes.push_back(maps.front().file().string() +
                                ": no imu0; noise figures are those of EuRoC's inertial sensor");
  return calibration;
}

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

RigCalibration read_maps(const std::vector<CalibrationMap>& maps, const RigChoice& choice) {
  const CalibrationMap& first = maps.front();
  if (first.has("camera_matrix")) return read_camera_infos(maps, choice);
  if (first.has("T_BS"))
    throw DatasetError(first.file().string() +
                       ": one sensor.yaml of several; give the folder that holds cam0, cam1 and "
                       "imu0");
  if (!first.has("value0")) return read_kalibr(maps, choice);
  if (maps.size() > 1)
    throw DatasetError(maps[1].file().string() + ": a second file beside one of Basalt");
  return read_basalt(first, choice);
}

}  // namespace

RigCalibration read_rig(const std::vector<std::filesystem::path>& files, const RigChoice& choice) {
  if (files.empty()) throw DatasetError(std::string("no file of calibration: ") + kExpected);
  if (files.size() == 1 && is_folder(files[0]))
    return read_euroc_calibration(find_mav0(files[0]), choice);
  std::vector<CalibrationMap> maps;
  for (const std::filesystem::path& file : files) maps.emplace_back(file);
  return read_maps(maps, choice);
}

RigCalibration read_inline_rig(const CalibrationMap& map, const RigChoice& choice) {
  return read_maps({map}, choice);
}

std::optional<std::string> join_cameras(const Camera& left, const std::optional<Camera>& right,
                                        const RigChoice& choice, SensorRig& rig) {
  if (choice.depth) rig.depth = choice.depth->range;
  if (!right) {
    rig.stereo = rgbd_rig(left, choice.depth.value_or(DepthChoice{}).virtual_baseline_m);
    return std::nullopt;
  }
  rig.stereo = {.cameras = {left, *right}};
  return pair_problem(rig.stereo);
}

}  // namespace km
