#pragma once

#include <ostream>
#include <string>

namespace km {

/// One line of state for a person: redrawn in place on a terminal, else printed plainly every few
/// seconds. Log lines go above it and never into it. One per process. Thread-safe.
class StatusLine {
 public:
  /// On standard output; a terminal if isatty() says so.
  StatusLine();
  /// For tests: `output` outlives this.
  StatusLine(std::ostream& output, bool terminal, double plain_interval_s = 5.0);
  /// Leaves the last state standing on its own line.
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// Shows `text` (one line; cut to the terminal's width).
  void update(const std::string& text);
};

}  // namespace km
