#pragma once

#include <vector>

#include "modules/sensors/node/rig_calibration.hpp"

namespace km {

/// Reads Kalibr's files, see read_rig().
[[nodiscard]] RigCalibration read_kalibr(const std::vector<CalibrationMap>& maps,
                                         const RigChoice& choice);

}  // namespace km
