#pragma once

#include <filesystem>

#include "modules/sensors/folder_layouts.hpp"
#include "modules/sensors/node/rig_calibration.hpp"

namespace km {

/// The rig described by the `sensor.yaml` of cam0, cam1 and imu0 below `mav0` (EuRoC/ASL format).
/// Without a folder cam1 it is an RGB-D rig, with depth0 in place of the right camera. The body
/// frame is the IMU's: T_body_cam = T_BS(imu0)^-1 T_BS(cam). Without a folder imu0 the rig has no
/// inertial sensor, and the body frame is the reference of all T_BS. The nearest rotation replaces
/// rotations that are orthonormal to 1e-3.
///
/// Throws DatasetError with file and line for a missing file or key, models that read_camera()
/// refuses, and numbers that no sensor has (calibration_limits.hpp). Also throws DatasetError for a
/// T_BS that is not a rigid transform.
///
/// T_BS, resolution, intrinsics and distortion (if stated) of depth0/sensor.yaml must be those of
/// cam0, because depth must be aligned with the left image. Optional keys: `depth_scale` (of a
/// stored unit [m], default 0.001), `min_range_m` (0), `max_range_m` (65) and `baseline_m`, the
/// virtual baseline (see rgbd_rig(); default 0.1). SensorRig::depth is set for an RGB-D rig and, if
/// `with_depth`, for stereo cameras with depth0 beside them.
[[nodiscard]] SensorRig read_euroc_rig(const std::filesystem::path& mav0, bool with_depth = false);

/// The calibration in a folder of this format, with the cameras and the depth of `choice`; depth0
/// is not read. Errors as for read_euroc_rig().
[[nodiscard]] RigCalibration read_euroc_calibration(const std::filesystem::path& mav0,
                                                    const RigChoice& choice);

/// `baseline_m` of depth0. Errors as for read_euroc_rig().
[[nodiscard]] double read_depth_baseline_m(const std::filesystem::path& mav0);

/// `depth_scale` of depth0: metres of one unit stored in its images. Errors as for
/// read_euroc_rig().
[[nodiscard]] double read_depth_scale(const std::filesystem::path& mav0);

/// Lists the recording in `folder`, in any FolderLayout, with its calibration. `camera_file`
/// describes the camera of a folder in TUM's layout; empty: tum_camera(). It has the keys
/// `resolution`, `camera_model`, `intrinsics`, `distortion_model` and `distortion_coefficients` of
/// EuRoC's sensor.yaml, and the keys `depth_scale` [m] (0.0002), `min_range_m` (0), `max_range_m`
/// (8) and `baseline_m` (0.1) of depth0/sensor.yaml. Only EuRoC's layout uses the correction of
/// `options`, and has labels; requested depth must exist. Throws DatasetError if the folder or a
/// file cannot be used.
[[nodiscard]] ImageFolder read_folder(const std::filesystem::path& folder,
                                      const FolderOptions& options = {},
                                      const std::filesystem::path& camera_file = {});

/// A reader of the part of `options` of that recording. Throws the exceptions of read_folder() and
/// FolderReader.
[[nodiscard]] FolderReader open_folder(const std::filesystem::path& folder,
                                       const FolderOptions& options = {},
                                       const std::filesystem::path& camera_file = {});

}  // namespace km
