#pragma once

#include <sys/resource.h>

#include <cstdint>
#include <cstdio>
#include <string>

namespace km {

/// Processor time of the process so far, over all its threads.
struct ProcessorUse {
  double user_s = 0.0;
  double system_s = 0.0;  ///< In the kernel.
  std::int64_t page_faults = 0;
};

inline ProcessorUse processor_use() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {seconds(usage.ru_utime), seconds(usage.ru_stime), usage.ru_minflt};
}

/// "system 0.12 ms, 3.0 page faults", for each of `runs` since `before`: the share of the kernel in
/// addition to user code.
inline std::string kernel_share(const ProcessorUse& before, double runs) {
  const ProcessorUse now = processor_use();
  char text[96];
  std::snprintf(text, sizeof text, "system %.3g ms, %.3g page faults",
                1e3 * (now.system_s - before.system_s) / runs,
                static_cast<double>(now.page_faults - before.page_faults) / runs);
  return text;
}

}  // namespace km
