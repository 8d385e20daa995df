#pragma once

#include <functional>

namespace km {

/// Clock and heap of the process. Libraries read neither themselves.
struct CrowdMeter {
  std::function<double()> cpu_s = [] { return 0.0; };       ///< CPU time of this thread [s].
  std::function<double()> heap_bytes = [] { return 0.0; };  ///< Allocated memory [B].
};

/// Work of one robot.
struct CrowdWork {
  double cpu_s = 0.0;
  double heap_bytes = 0.0;  ///< Growth of the heap.

  /// Calls `work()`, adds its CPU time and the memory that it leaves allocated, and returns its
  /// result. Calls must not nest.
  template <typename F>
  decltype(auto) run(const CrowdMeter& meter, F&& work) {
    struct Reading {
      const CrowdMeter& meter;
      CrowdWork& sum;
      double heap_bytes = meter.heap_bytes();
      double cpu_s = meter.cpu_s();
      ~Reading() {
        sum.cpu_s += meter.cpu_s() - cpu_s;
        sum.heap_bytes += meter.heap_bytes() - heap_bytes;
      }
    };
    const Reading reading{meter, *this};
    return work();
  }
};

}  // namespace km
