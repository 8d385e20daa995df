#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/sensors/calibration_map_codec.hpp"

namespace km {

/// What a calibration says of a robot's sensors. The body frame is the inertial sensor's.
struct RigCalibration {
  SensorRig rig;
  bool has_cameras = true;
  /// False: T_body_cam are poses in the left camera's frame; where that is on the body is not told.
  bool is_placed = true;
  /// What is added to the stamps of images to get the inertial sensor's time [s]:
  /// t_imu = t_image + offset. nullopt: it is not told.
  std::optional<double> image_time_offset_s = std::nullopt;
  /// Topics of ROS, left and right; empty: not told.
  std::array<std::string, 2> image_topics = {};
  std::string imu_topic = {};
  /// What the files say and nothing here uses, or do not say and a default stands for: for people,
  /// one line each that names file and line.
  std::vector<std::string> notes = {};
};

/// Depth images beside the left camera, or in place of the right one.
struct DepthChoice {
  DepthRange range;
  double virtual_baseline_m = 0.1;  ///< Without a right camera, see rgbd_rig().
};

/// What a calibration does not tell of itself.
struct RigChoice {
  /// Which of the cameras (cam0, cam1, ...) are the pair. Without a right one there is depth.
  std::size_t left = 0;
  std::optional<std::size_t> right = 1;
  std::optional<DepthChoice> depth = std::nullopt;
  /// Topics may tell the cameras, or where they are: they may be missing.
  bool may_be_partial = false;
};

/// Reads a calibration: a folder of EuRoC's sensor.yaml, Kalibr's files or Basalt's, whichever
/// `files` are. Throws DatasetError, naming file, line, key and value, for what is none of these,
/// is missing or cannot be meant, for models that read_camera() refuses, and for a single camera
/// without depth.
///
/// Kalibr: a chain of cameras, alone or with `imu0` in it, and a file of the inertial sensor, a
/// chain with `imu0` or the flat imu.yaml. The formats are those of Kalibr's wiki, "Yaml formats":
/// T_cam_imu takes points from the inertial sensor's frame to the camera's, T_cn_cnm1 those of the
/// camera before, timeshift_cam_imu is t_imu - t_cam. OpenVINS names T_imu_cam, the inverse,
/// instead. Without a file of the inertial sensor its noise is ImuNoise's default, with a note.
/// Time shifts of left and right further apart than 1 ms are refused.
///
/// Basalt: T_imu_cam, the camera in the inertial sensor's frame; cameras of type pinhole,
/// pinhole-radtan8, kb4, ds and ucm; noise of continuous time, the largest where there is one for
/// each axis; cam_time_offset_ns, which is added to the stamps of images. The limit rpmax of
/// pinhole-radtan8 is not used: where the model folds back is known (see Lens). Nor are the
/// constant biases and scales of the inertial sensor, with a note where they are not 0.
///
/// EuRoC: see read_euroc_rig(); what depth0 says is not used.
[[nodiscard]] RigCalibration read_rig(const std::vector<std::filesystem::path>& files,
                                      const RigChoice& choice = {});

/// The same of a map in some other file, with the keys of Kalibr's files or Basalt's.
[[nodiscard]] RigCalibration read_inline_rig(const CalibrationMap& map,
                                             const RigChoice& choice = {});

/// For readers of calibrations: the cameras of `rig` and its depth, as `choice` wants them; what is
/// wrong with the pair, see pair_problem().
[[nodiscard]] std::optional<std::string> join_cameras(const Camera& left,
                                                      const std::optional<Camera>& right,
                                                      const RigChoice& choice, SensorRig& rig);

}  // namespace km
