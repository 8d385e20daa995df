#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>

#include "apps/result_writer.hpp"

namespace km {

/// A result that grows during the run, so that what is recorded survives a crash. Where the disk is
/// full it goes on once there is room, without a row lost or torn unless more than kMaxWaiting
/// bytes wait. Not thread-safe.
class GrowingFile {
 public:
  static constexpr std::size_t kMaxWaiting_bytes = std::size_t{4} << 20;

  /// `results` outlives this, and learns whether the file is whole.
  GrowingFile(std::filesystem::path file, ResultWriter& results)
      : file_(std::move(file)), results_(results) {}

  /// Goes on with what an earlier process has left; its rows. One that is torn is cut off with the
  /// next flush(). Call before that, if at all.
  [[nodiscard]] std::string go_on();

  /// Where rows go.
  [[nodiscard]] std::ostream& rows() { return rows_; }

  /// Writes the rows that have come.
  void flush();

 private:
  void append();

  const std::filesystem::path file_;
  ResultWriter& results_;
  std::ostringstream rows_;
  std::optional<std::uintmax_t> keep_bytes_ = {};  // of what is there, until the rest is cut off
  std::string waiting_;
  bool rows_lost_ = false;
};

}  // namespace km
