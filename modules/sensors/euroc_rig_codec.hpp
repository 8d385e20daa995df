#pragma once

#include <filesystem>

#include "modules/core/camera.hpp"
#include "modules/sensors/euroc_reader.hpp"
#include "modules/sensors/rig_calibration_codec.hpp"

namespace km {

/// The rig described by the `sensor.yaml` of cam0, cam1 and imu0 below `mav0` (EuRoC/ASL format).
/// Without a folder cam1 it is an RGB-D rig: depth0 in place of the right camera. The body frame is
/// the IMU's: T_body_cam = T_BS(imu0)^-1 T_BS(cam); unless `needs_imu`, without a folder imu0, it
/// is that of all T_BS. Rotations that are orthonormal to 1e-3 are
/// replaced by the nearest rotation. Throws DatasetError, naming file and line, for a missing file
/// or key, a T_BS that is not a rigid transform (with how far off it is), models that read_camera()
/// refuses, and numbers that no sensor has (calibration_limits.hpp).
///
/// depth0/sensor.yaml: T_BS, resolution, intrinsics and, where given, distortion are those of cam0,
/// else it is refused, as depth must be aligned with the left image. Optional keys: `depth_scale`
/// (of a stored unit [m], default 0.001), `min_range_m` (0), `max_range_m` (65) and `baseline_m`,
/// the virtual baseline (see rgbd_rig(); default 0.1). SensorRig::depth is set for an RGB-D rig
/// and, `with_depth`, for stereo cameras with depth0 beside them.
[[nodiscard]] SensorRig read_euroc_rig(const std::filesystem::path& mav0, bool with_depth = false,
                                       bool needs_imu = true);

/// The calibration in such a folder, of the cameras and with the depth of `choice`: depth0 is not
/// looked at. Errors as above.
[[nodiscard]] RigCalibration read_euroc_calibration(const std::filesystem::path& mav0,
                                                    const RigChoice& choice);

/// `depth_scale` of depth0: metres of one unit stored in its images. Errors as above.
[[nodiscard]] double read_depth_scale(const std::filesystem::path& mav0);

/// A reader of the recording in `folder`, calibrated by its own files; depth asked for must be
/// there. Throws what read_euroc_rig() and EurocReader throw.
[[nodiscard]] EurocReader open_euroc(const std::filesystem::path& folder,
                                     const EurocOptions& options = {});

}  // namespace km
