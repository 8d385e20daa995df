#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

namespace km {

/// What the work of a team is measured with: modules read no clocks.
struct TeamMeter {
  std::function<double()> cpu_s = [] { return 0.0; };  ///< CPU time of this thread [s].
};

/// Work of one round, or sums of it.
struct TeamWork {
  std::size_t bytes = 0;
  double critical_path_s = 0.0;  ///< Of the slowest robot of each round.
  double total_cpu_s = 0.0;      ///< Of all robots.

  TeamWork& operator+=(const TeamWork& other) {
    bytes += other.bytes;
    critical_path_s += other.critical_path_s;
    total_cpu_s += other.total_cpu_s;
    return *this;
  }
};

/// Measures the rounds of a team that is run in one thread. Not thread-safe.
class RoundMeter {
 public:
  RoundMeter(std::size_t robots, TeamMeter meter) : meter_(std::move(meter)), cpu_s_(robots, 0.0) {}

  /// Calls `work()`, at the expense of `robot`, and returns its result. Calls must not nest.
  template <typename F>
  decltype(auto) run(std::size_t robot, F&& work) {
    struct Stopwatch {
      const TeamMeter& meter;
      double& sum_s;
      double start_s = meter.cpu_s();
      ~Stopwatch() { sum_s += meter.cpu_s() - start_s; }
    };
    const Stopwatch stopwatch{meter_, cpu_s_[robot]};
    return work();
  }

  /// Counts a message of so many bytes, see message_sizes.hpp. One to all peers alike is a
  /// broadcast and counts once.
  void sent(std::size_t bytes) { bytes_ += bytes; }

  /// Work since the last call.
  TeamWork finish_round() {
    TeamWork work{.bytes = bytes_};
    for (double& s : cpu_s_) {
      work.critical_path_s = std::max(work.critical_path_s, s);
      work.total_cpu_s += s;
      s = 0.0;
    }
    bytes_ = 0;
    return work;
  }

 private:
  TeamMeter meter_;
  std::vector<double> cpu_s_;  // per robot, in this round
  std::size_t bytes_ = 0;
};

}  // namespace km
