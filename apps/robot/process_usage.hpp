#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <vector>

namespace km {

/// What this process has taken of the machine, all its threads together.
struct ProcessUsage {
  double cpu_s = 0.0;
  std::uint64_t resident_bytes = 0;  ///< Now; shared libraries included.
  std::uint64_t peak_bytes = 0;      ///< Most there ever were resident.
};

/// As the kernel has it; resident_bytes is 0 where /proc cannot be read.
[[nodiscard]] ProcessUsage process_usage();

/// Memory over time in three numbers.
struct MemoryTrend {
  std::uint64_t first_bytes = 0;
  std::uint64_t last_bytes = 0;
  /// Slope of the line of least squares through the second half of the time; absent if that is less
  /// than a minute: what is taken at the start is no growth.
  std::optional<double> growth_bytes_per_minute;
};

/// Writes process.csv, a row for each sample: time_s, cpu_s, resident_bytes.
class ProcessCsv {
 public:
  /// Writes the header line. `output` outlives this.
  explicit ProcessCsv(std::ostream& output);

  /// `time_s` ascends.
  void append(double time_s, const ProcessUsage& usage);

  [[nodiscard]] MemoryTrend memory() const;

 private:
  struct Sample {
    double time_s = 0.0;
    double bytes = 0.0;
  };
  std::ostream& output_;
  std::vector<Sample> samples_;
};

}  // namespace km
