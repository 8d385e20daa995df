#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "apps/result_writer.hpp"
#include "apps/robot/run_summary.hpp"
#include "modules/core/data/pose_graph.hpp"

namespace km {

/// A result file that grows during the run, so that recorded rows survive a crash. While the disk
/// is full, rows wait in memory and are written once there is room. No row is lost or cut in two
/// unless more than kMaxWaiting_bytes wait. They also wait while the folder is gone. If the folder
/// is there but the file has been deleted, the file begins again with its header. Not thread-safe.
class GrowingFile {
 public:
  static constexpr std::size_t kMaxWaiting_bytes = std::size_t{4} << 20;

  /// `results` outlives this; it records whether the file is complete.
  GrowingFile(std::filesystem::path file, ResultWriter& results)
      : file_(std::move(file)), results_(results) {}

  /// Continues the file of an earlier process and returns its rows. The next flush() cuts off an
  /// incomplete last row. Call before the first flush().
  [[nodiscard]] std::string go_on();

  /// Stream to which rows are written.
  [[nodiscard]] std::ostream& rows() { return rows_; }

  /// Writes the rows added since the last call.
  void flush();

 private:
  void append();

  const std::filesystem::path file_;
  ResultWriter& results_;
  std::ostringstream rows_;
  std::optional<std::uintmax_t> keep_bytes_ =
      {};               // length of the earlier file without its incomplete last row
  std::string header_;  // first row
  std::string waiting_;
  bool is_begun_ = false;   // the file has its header
  bool rows_gone_ = false;  // earlier rows have been deleted
  bool rows_lost_ = false;
};

/// Processor time and memory of this process, over all its threads.
struct ProcessUsage {
  double cpu_s = 0.0;                ///< Processor time, user and system.
  double system_s = 0.0;             ///< Processor time in the kernel.
  std::uint64_t page_faults = 0;     ///< Minor page faults: without input from a disk.
  std::uint64_t resident_bytes = 0;  ///< Present value; shared libraries included.
  std::uint64_t peak_bytes = 0;      ///< Largest value since the start.
};

/// Values from the kernel; resident_bytes is 0 if /proc cannot be read.
[[nodiscard]] ProcessUsage process_usage();

/// Returns the pages that are free inside the heap to the kernel, see malloc_trim(3). Threads that
/// allocate meanwhile may wait.
void return_freed_memory();

/// Writes process.csv, a row for each sample: time_s, cpu_s, resident_bytes, system_s, page_faults.
class ProcessCsv {
 public:
  /// Writes the header line, or continues after the rows of `former` processes: processor times and
  /// page faults are sums over all processes. `output` outlives this.
  explicit ProcessCsv(std::ostream& output, std::string_view former = {});

  /// Time of the last row of former processes [s]; 0 without any.
  [[nodiscard]] double former_s() const { return former_s_; }

  /// `time_s` ascends, starting at former_s().
  void append(double time_s, const ProcessUsage& usage);

  /// Summary of all samples of this process; times and the peak are those of the last sample.
  [[nodiscard]] ProcessSummary summary() const;

 private:
  struct Sample {
    double time_s = 0.0;
    ProcessUsage usage;
  };
  std::ostream& output_;
  double former_s_ = 0.0;
  ProcessUsage former_;
  std::vector<Sample> samples_;
};

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
