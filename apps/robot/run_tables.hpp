#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

// Tables of numbers among the results of a robot. Readers throw std::runtime_error that names the
// file, and the line if a line cannot be used.

/// A row of process.csv (3 columns) or optimizer.csv (5) as finite numbers.
using NumberRow = std::vector<double>;
[[nodiscard]] std::vector<NumberRow> read_number_rows(const std::filesystem::path& file,
                                                      std::size_t columns);

/// A row of traffic.csv: messages and bytes from the start of the run to `time_s`, with
/// retransmissions.
struct TrafficRow {
  double time_s = 0.0;
  bool out = false;
  std::string topic, category, peer;
  double messages = 0.0, bytes = 0.0;
};
[[nodiscard]] std::vector<TrafficRow> read_traffic(const std::filesystem::path& file);

/// A row of timing.csv: the steps of one module.
struct ModuleTiming {
  std::string module;
  double calls = 0.0;
  double median_ms = 0.0, p95_ms = 0.0, max_ms = 0.0;  ///< Times of a step.
  double total_s = 0.0;
};
[[nodiscard]] std::vector<ModuleTiming> read_timing(const std::filesystem::path& file);

/// Reads the traffic of a robot in the order of time.
class TrafficUntil {
 public:
  /// `rows` ascend by time and outlive this.
  explicit TrafficUntil(const std::vector<TrafficRow>& rows) : rows_(rows) {}

  /// Advances to `time_s`, which is not before that of the last call.
  void advance(double time_s);

  /// Bytes sent so far, by category.
  [[nodiscard]] const std::map<std::string, double>& sent() const { return sent_; }
  [[nodiscard]] double sent(const std::string& category) const;

  /// Robots received so far, and the time since their last message [s].
  [[nodiscard]] std::map<RobotId, double> silent_s() const;

 private:
  const std::vector<TrafficRow>& rows_;
  std::size_t next_ = 0;
  double time_s_ = 0.0;
  std::map<std::tuple<bool, std::string, std::string>, TrafficRow> sums_;
  std::map<std::string, double> sent_;
  std::map<RobotId, double> last_received_s_;
};

}  // namespace km
