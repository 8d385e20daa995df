#pragma once

#include <filesystem>

#include "modules/core/camera.hpp"
#include "modules/sensors/euroc_reader.hpp"
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

/// `depth_scale` of depth0: metres of one unit stored in its images. Errors as for
/// read_euroc_rig().
[[nodiscard]] double read_depth_scale(const std::filesystem::path& mav0);

/// A reader of the recording in `folder`, with the calibration in its files. Requested depth must
/// exist.
/// Throws the exceptions of read_euroc_rig() and EurocReader.
[[nodiscard]] EurocReader open_euroc(const std::filesystem::path& folder,
                                     const EurocOptions& options = {});

}  // namespace km
