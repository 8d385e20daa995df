#pragma once

#include <ctime>

namespace km {

/// CPU time of the calling thread [s].
[[nodiscard]] inline double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace km
