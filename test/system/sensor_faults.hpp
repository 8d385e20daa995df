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
  /// Spoils what is from `begin` to before `end`.
  std::function<void(EurocCopy&, Stamp begin, Stamp end)> spoil;
  std::string event = {};    ///< In the log of a robot that meets it.
  double bound_m = 0.1;      ///< Of the position, while it lasts and after it.
  bool is_blind = false;     ///< For a while no image holds the pose.
  bool is_at_start = false;  ///< From the first image on.
};

/// All, in the order in which they are told of.
[[nodiscard]] std::vector<SensorFault> sensor_faults();

}  // namespace km
