#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/sensors/node/calibration_map.hpp"

namespace km {

/// Calibration of a robot's sensors. The body frame is the inertial sensor's.
struct RigCalibration {
  SensorRig rig;
  bool has_cameras = true;  ///< False: at most the poses of the cameras are known.
  /// False: T_body_cam are poses in the left camera's frame, whose pose on the body is unknown.
  bool has_extrinsics = true;
  bool has_pair = true;  ///< False: the relative pose of the cameras is unknown.
  /// Offset [s] from the stamps of images to the inertial sensor's time: t_imu = t_image + offset.
  /// nullopt: unknown.
  std::optional<double> image_time_offset_s = std::nullopt;
  /// Topics of ROS, left and right; empty: unknown.
  std::array<std::string, 2> image_topics = {};
  std::string imu_topic = {};
  /// Remarks for the user, one line each with file and line: values in the files that are not used,
  /// and missing values for which a default is used.
  std::vector<std::string> notes = {};
};

/// Depth images beside the left camera, or in place of the right one.
struct DepthChoice {
  DepthRange range;
  double virtual_baseline_m = 0.1;  ///< Without a right camera, see rgbd_rig().
};

/// Choices that a calibration does not contain.
struct RigChoice {
  /// Numbers of the cameras of the pair (cam0, cam1, ...). Without a right camera there is depth.
  std::size_t left = 0;
  std::optional<std::size_t> right = 1;
  std::optional<DepthChoice> depth = std::nullopt;
  /// Topics may supply the cameras or their poses, so either or both may be missing.
  bool may_be_partial = false;
  bool rectified = false;  ///< Images are rectified: files of ROS contain both kinds of cameras.
};

/// Reads a calibration: a folder of EuRoC's sensor.yaml, Kalibr's files or Basalt's; the format is
/// detected. Throws DatasetError with file, line, key and value if a file has no known format. Also
/// throws it for missing or impossible values, for models that read_camera() refuses, and for a
/// single camera without depth.
///
/// Kalibr: a chain of cameras, alone or with `imu0` in it, and a file of the inertial sensor, a
/// chain with `imu0` or the flat imu.yaml. The formats are those of Kalibr's wiki, "Yaml formats".
/// T_cam_imu maps points from the inertial sensor's frame to the camera's, and T_cn_cnm1 those of
/// the camera before. timeshift_cam_imu is t_imu - t_cam. OpenVINS states T_imu_cam, the inverse,
/// instead. Without a file of the inertial sensor its noise is ImuNoise's default, with a note.
/// Time shifts of left and right further apart than 1 ms are refused.
///
/// Basalt: T_imu_cam is the camera in the inertial sensor's frame. Types of cameras are pinhole,
/// pinhole-radtan8, kb4, ds and ucm. Noise is that of continuous time, the largest of the three
/// axes. cam_time_offset_ns is added to the stamps of images. The limit rpmax of pinhole-radtan8
/// is not used, because Lens computes where the model folds back. The constant biases and scales of
/// the inertial sensor are not used either, with a note if they are not 0.
///
/// EuRoC: see read_euroc_rig(); depth0 is not used.
///
/// ROS: one file of camera_calibration (camera_info) for each camera, left first, without the pose
/// on the body.
[[nodiscard]] RigCalibration read_rig(const std::vector<std::filesystem::path>& files,
                                      const RigChoice& choice = {});

/// Reads a calibration from a map in some other file, with the keys of Kalibr's files or Basalt's.
[[nodiscard]] RigCalibration read_inline_rig(const CalibrationMap& map,
                                             const RigChoice& choice = {});

/// For readers of calibrations: sets the cameras of `rig` and its depth according to `choice`.
/// Returns the problem of the pair, see pair_problem().
[[nodiscard]] std::optional<std::string> join_cameras(const Camera& left,
                                                      const std::optional<Camera>& right,
                                                      const RigChoice& choice, SensorRig& rig);

}  // namespace km
