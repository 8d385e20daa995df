#pragma once

#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string_view>
#include <vector>

#include "modules/core/pose_graph.hpp"

namespace km {

/// Writes optimizer.csv, a row after every round: seconds, round, members, cost, gradient_norm; see
/// OptimizerProgress.
class RoundsCsv {
 public:
  /// Writes the header line, or continues after the rows of `former` processes, whose rounds and
  /// time are added. `output` outlives this.
  explicit RoundsCsv(std::ostream& output, std::string_view former = {});

  /// `rounds`: all rounds of this process so far. Writes those that are new.
  void append(const std::vector<OptimizerProgress>& rounds);

 private:
  std::ostream& output_;
  double former_s_ = 0.0;
  std::uint32_t former_rounds_ = 0;
  std::size_t written_ = 0;
};

}  // namespace km
