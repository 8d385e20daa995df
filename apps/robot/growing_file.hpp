#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>

#include "apps/result_writer.hpp"

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

}  // namespace km
