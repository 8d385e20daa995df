#pragma once

#include "modules/sensors/node/rig_calibration.hpp"

namespace km {

/// Reads Basalt's file, see read_rig().
[[nodiscard]] RigCalibration read_basalt(const CalibrationMap& map, const RigChoice& choice);

}  // namespace km
