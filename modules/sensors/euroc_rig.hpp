#pragma once

#include <filesystem>

#include "modules/core/camera.hpp"

namespace km {

/// The rig described by cam0, cam1 and imu0 `sensor.yaml` below `mav0` (EuRoC/ASL format). The body
/// frame is the IMU's: T_body_cam = T_BS(imu0)^-1 T_BS(cam). Rotations that are orthonormal to 1e-3
/// are replaced by the nearest rotation. Throws DatasetError, naming file and line, for a missing
/// file or key, a T_BS that is not a rigid transform (with how far off it is), a camera or
/// distortion model other than pinhole with four radial-tangential coefficients, and numbers
/// without sense.
[[nodiscard]] SensorRig read_euroc_rig(const std::filesystem::path& mav0);

}  // namespace km
