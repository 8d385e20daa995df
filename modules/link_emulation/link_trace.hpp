#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace km {

/// A trace file that cannot be used. what() is one line of text. It names the file, and the line
/// number if a row is the cause.
struct LinkTraceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Rate and delay of a link at an instant of the run; see LinkTrace for the times between two rows.
struct LinkTraceRow {
  double time_s = 0.0;
  double bytes_per_s = 0.0;  ///< Infinite if the link has no limit at any time.
  double delay_s = 0.0;      ///< Time from leaving the queue to arrival.
};

/// Rate and delay of a link over time, linear between rows and constant before the first and after
/// the last row.
class LinkTrace {
 public:
  /// Throws std::invalid_argument unless there is a row, times are finite and increase strictly,
  /// delays are finite and not negative, and rates are not negative. All rates must be finite,
  /// except for the rate of a single row.
  explicit LinkTrace(std::vector<LinkTraceRow> rows);

  [[nodiscard]] bool has_limit() const;

  /// [s]
  [[nodiscard]] double delay_s(double time_s) const;

  /// Bytes that the link can carry from the first row until `time_s`; negative before that row.
  /// Precondition: the rate is finite. O(log rows).
  [[nodiscard]] double capacity_until(double time_s) const;

  /// The first time at which capacity_until() is `bytes`; infinite if there is none.
  /// Precondition: the rate is finite.
  [[nodiscard]] double time_of(double bytes) const;

 private:
  std::vector<LinkTraceRow> rows_;
  std::vector<double> capacity_;  // capacity_until() of the time of each row
};

/// Parses a table with the columns time_s, bytes_per_s, delay_s, which may be named in its first
/// row. `name` stands for the file in messages. Throws LinkTraceError for a row with another number
/// of fields, a field that is not a finite number, and a negative rate or delay. It also throws if
/// times do not increase or there are no rows.
[[nodiscard]] LinkTrace parse_link_trace(std::string_view text, const std::string& name);

/// Reads the table from a file. Throws LinkTraceError.
[[nodiscard]] LinkTrace read_link_trace(const std::filesystem::path& file);

/// Capacity of a recorded link: the instants at which it carries one packet of kPacket_bytes. The
/// schedule begins with the run and repeats at its last instant. Smaller packets share an instant,
/// and an instant without a waiting packet is lost (Netravali et al., "Mahimahi: Accurate
/// Record-and-Replay for HTTP", USENIX ATC 2015, whose files these are).
class PacketSchedule {
 public:
  static constexpr double kPacket_bytes = 1500.0;

  /// For instants [ms]. Throws std::invalid_argument unless they do not decrease and the last one
  /// is positive.
  explicit PacketSchedule(std::vector<std::uint32_t> times_ms);

  /// Bytes that the link can carry from the start of the run until `time_s`, inclusive. O(log
  /// instants). Precondition: `time_s` is finite, and not negative.
  [[nodiscard]] double capacity_until(double time_s) const;

  /// The first time at which capacity_until() is at least `bytes`.
  /// Precondition: `bytes` is finite, and not negative.
  [[nodiscard]] double time_of(double bytes) const;

 private:
  std::vector<std::uint32_t> times_ms_;
};

/// Parses a text with one instant [ms] a line. `name` stands for the file in messages. Throws
/// LinkTraceError for a line that is not one whole number from 0 to 2^32 - 1, for instants that
/// decrease, and if the last instant is 0 or missing.
[[nodiscard]] PacketSchedule parse_packet_schedule(std::string_view text, const std::string& name);

/// Reads the text from a file. Throws LinkTraceError.
[[nodiscard]] PacketSchedule read_packet_schedule(const std::filesystem::path& file);

}  // namespace km
