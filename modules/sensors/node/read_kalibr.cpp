#include <cmath>
#include <utility>

#include "modules/core/calibration_limits.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/node/calibration_map.hpp"
#include "modules/sensors/node/rig_calibration.hpp"

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
                         ": neither cam0 nor imu0 nor the noise of an inertial sensor: not a file "
                         "of Kalibr");
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

}  // namespace

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

}  // namespace km
