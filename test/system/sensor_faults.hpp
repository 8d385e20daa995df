#pragma once

#include <functional>
#include <string>
#include <vector>

#include "test/support/euroc_copy.hpp"

namespace km {

/// A way in which sensors fail for a while.
struct SensorFault {
  std::string name;
  double lasts_s = 0.0;
  /// Corrupts the data from `begin` to before `end`.
  std::function<void(EurocCopy&, Stamp begin, Stamp end)> corrupt;
  std::string event = {};    ///< Text in the log of a robot with this fault.
  double bound_m = 0.1;      ///< Bound on the position error, during the fault and after it.
  bool is_blind = false;     ///< For a while no image holds the pose.
  bool is_at_start = false;  ///< From the first image on.
};

/// All faults, in the order of the report.
[[nodiscard]] std::vector<SensorFault> sensor_faults();

}  // namespace km
