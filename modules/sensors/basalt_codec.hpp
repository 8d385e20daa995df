#pragma once

#include "modules/sensors/rig_calibration_codec.hpp"

namespace km {

/// Reads Basalt's file, see read_rig().
[[nodiscard]] RigCalibration read_basalt(const CalibrationMap& map, const RigChoice& choice);

}  // namespace km
