#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace km {

// Tables of numbers among the results of a robot. Readers throw std::runtime_error that names the
// file, and the line if a line cannot be used.

/// A row of process.csv (3 columns) or optimizer.csv (5) as finite numbers.
using NumberRow = std::vector<double>;
[[nodiscard]] std::vector<NumberRow> read_number_rows(const std::filesystem::path& file,
                                                      std::size_t columns);

/// Bytes sent from the start of the run to a time of traffic.csv, with retransmissions.
struct SentBytes {
  double time_s = 0.0;
  std::map<std::string, double> by_category;
};
/// All times of traffic.csv, which ascend.
[[nodiscard]] std::vector<SentBytes> read_sent(const std::filesystem::path& file);

/// A row of timing.csv: the steps of one module.
struct ModuleTiming {
  std::string module;
  double calls = 0.0;
  double median_ms = 0.0, p95_ms = 0.0, max_ms = 0.0;  ///< Times of a step.
  double total_s = 0.0;
};
[[nodiscard]] std::vector<ModuleTiming> read_timing(const std::filesystem::path& file);

}  // namespace km
