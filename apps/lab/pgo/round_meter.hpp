#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"

namespace km {

/// Clock by which the work of a team is measured. Modules read no clocks themselves.
struct TeamMeter {
  std::function<double()> cpu_s = [] { return 0.0; };  ///< CPU time of this thread [s].
};

/// Adds the CPU time of its existence to a sum.
struct CpuStopwatch {
  const TeamMeter& meter;
  double& sum_s;
  double start_s = meter.cpu_s();
  ~CpuStopwatch() { sum_s += meter.cpu_s() - start_s; }
};

/// Work of one round, or sums of it.
struct TeamWork {
  std::size_t bytes = 0;
  double critical_path_s = 0.0;  ///< CPU time of the slowest robot, summed over exchanges.
  double total_cpu_s = 0.0;      ///< CPU time, summed over robots.

  TeamWork& operator+=(const TeamWork& other) {
    bytes += other.bytes;
    critical_path_s += other.critical_path_s;
    total_cpu_s += other.total_cpu_s;
    return *this;
  }
};

/// Bytes of a pose in a message between robots: single precision, with its index.
inline constexpr std::size_t kPoseBytes = 7 * sizeof(float) + 2;

/// Measures the rounds of a team that is run in one thread. Not thread-safe.
class RoundMeter {
 public:
  RoundMeter(std::size_t robots, TeamMeter meter) : meter_(std::move(meter)), cpu_s_(robots, 0.0) {}

  /// Calls `work()`, adds its CPU time to that of `robot`, and returns its result. Calls must not
  /// nest.
  template <typename F>
  decltype(auto) run(std::size_t robot, F&& work) {
    const CpuStopwatch stopwatch{meter_, cpu_s_[robot]};
    return work();
  }

  /// Counts a message of `bytes` bytes. A message with the same content for
  /// all peers is a broadcast and counts once.
  void sent(std::size_t bytes) { round_.bytes += bytes; }

  /// Marks that later work of the robots depends on messages sent before. Without a call a round is
  /// one exchange.
  void finish_exchange() {
    round_.critical_path_s += *std::max_element(cpu_s_.begin(), cpu_s_.end());
    for (double& s : cpu_s_) round_.total_cpu_s += std::exchange(s, 0.0);
  }

  /// Work since the last call.
  TeamWork finish_round() {
    finish_exchange();
    return std::exchange(round_, {});
  }

 private:
  TeamMeter meter_;
  std::vector<double> cpu_s_;  // per robot, in this exchange
  TeamWork round_;
};

/// State of the team after a round.
struct TeamRound {
  int round = 0;               ///< Rounds of the team so far.
  double cost = 0.0;           ///< Chordal cost, without 1/2, with all verticals.
  double gradient_norm = 0.0;  ///< Riemannian gradient of the whole graph.
  TeamWork work;               ///< Work up to and including this round.
};

/// Calls step(meter), which returns the number of rounds that it took, until that is 0 or
/// `max_rounds` are over. Cost and gradient at poses() are evaluated centrally, and their CPU time
/// is not counted. Entry 0 is the state at the start, without work.
[[nodiscard]] std::vector<TeamRound> run_rounds(const TeamGraph& graph,
                                                const std::function<std::vector<SE3>()>& poses,
                                                const std::function<int(RoundMeter&)>& step,
                                                int max_rounds, const TeamMeter& meter);

}  // namespace km
