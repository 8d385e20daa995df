#pragma once

#include <cstdint>
#include <ostream>
#include <vector>

#include "apps/robot/run_summary.hpp"

namespace km {

/// What this process has taken of the machine, all its threads together.
struct ProcessUsage {
  double cpu_s = 0.0;
  std::uint64_t resident_bytes = 0;  ///< Now; shared libraries included.
  std::uint64_t peak_bytes = 0;      ///< Most there ever were resident.
};

/// As the kernel has it; resident_bytes is 0 where /proc cannot be read.
[[nodiscard]] ProcessUsage process_usage();

/// Writes process.csv, a row for each sample: time_s, cpu_s, resident_bytes.
class ProcessCsv {
 public:
  /// Writes the header line. `output` outlives this.
  explicit ProcessCsv(std::ostream& output);

  /// `time_s` ascends.
  void append(double time_s, const ProcessUsage& usage);

  /// Of all samples; those of time and of the peak are the last one's.
  [[nodiscard]] RunSummary::Process summary() const;

 private:
  struct Sample {
    double time_s = 0.0;
    ProcessUsage usage;
  };
  std::ostream& output_;
  std::vector<Sample> samples_;
};

}  // namespace km
