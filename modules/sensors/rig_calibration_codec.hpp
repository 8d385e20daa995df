#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera.hpp"

namespace km {

/// What files of calibration say of a robot's sensors. The body frame is the inertial sensor's.
struct RigCalibration {
  SensorRig rig;
  /// What is added to the stamps of images to get the inertial sensor's time [s]:
  /// t_imu = t_image + offset. nullopt: the files do not tell.
  std::optional<double> image_time_offset_s;
  /// Topics of ROS, left and right; empty: not told.
  std::array<std::string, 2> image_topics;
  std::string imu_topic;
  /// What the files say and nothing here uses, or do not say and a default stands for: for people,
  /// one line each that names file and line.
  std::vector<std::string> notes;
};

/// What a file of Kalibr or Basalt does not tell of itself. A folder of EuRoC does.
struct RigChoice {
  /// Which of the cameras (cam0, cam1, ...) are the pair.
  std::size_t left = 0;
  std::size_t right = 1;
  /// Set: the left camera has depth images of this range, and there is no right one.
  std::optional<DepthRange> depth = std::nullopt;
  /// Then: the virtual baseline, see rgbd_rig().
  double virtual_baseline_m = 0.1;
};

/// Kalibr's files: a chain of cameras, alone or with `imu0` in it, and a file of the inertial
/// sensor, a chain with `imu0` or the flat imu.yaml. The formats are those of Kalibr's wiki, "Yaml
/// formats": T_cam_imu takes points from the inertial sensor's frame to the camera's, T_cn_cnm1
/// those of the camera before, timeshift_cam_imu is t_imu - t_cam. OpenVINS names T_imu_cam, the
/// inverse, instead. Without a file of the inertial sensor its noise is ImuNoise's default, with a
/// note.
///
/// Throws DatasetError, naming file, line, key and value, for what is missing or cannot be meant,
/// for models that read_camera() refuses, and for time shifts of left and right further apart than
/// 1 ms.
[[nodiscard]] RigCalibration read_kalibr(const std::vector<std::filesystem::path>& files,
                                         const RigChoice& choice = {});

/// Basalt's JSON: T_imu_cam, the camera in the inertial sensor's frame; cameras of type pinhole,
/// pinhole-radtan8, kb4, ds and ucm; noise of continuous time, the largest where there is one for
/// each axis; cam_time_offset_ns, which is added to the stamps of images. Errors as above. The
/// limit rpmax of pinhole-radtan8 is not used: where the model folds back is known (see Lens). Nor
/// are the constant biases and scales of the inertial sensor, with a note where they are not 0.
[[nodiscard]] RigCalibration read_basalt(const std::filesystem::path& file,
                                         const RigChoice& choice = {});

/// Whichever of these `files` are: a folder of EuRoC's sensor.yaml (see read_euroc_rig()), one or
/// two files of Kalibr, or one of Basalt. Throws DatasetError for what is none of these, for a
/// single camera without depth, and as the readers do.
[[nodiscard]] RigCalibration read_rig(const std::vector<std::filesystem::path>& files,
                                      const RigChoice& choice = {});

}  // namespace km
