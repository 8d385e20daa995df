#pragma once

#include <cstdint>

namespace km {

/// Sensor time: nanoseconds of the dataset's or the sensor's clock.
using Stamp = std::int64_t;

/// later - earlier [s].
inline double seconds_between(Stamp earlier, Stamp later) {
  return static_cast<double>(later - earlier) * 1e-9;
}

/// `seconds` as a duration [ns], rounded towards zero.
inline Stamp nanoseconds(double seconds) {
  return static_cast<Stamp>(seconds * 1e9);
}

}  // namespace km
