#pragma once

#include <functional>
#include <map>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>

namespace km {

/// Passes at most one message per key and interval, and counts the suppressed messages.
/// Memory is bounded. Not thread-safe.
class RateLimit {
 public:
  explicit RateLimit(double interval_s) : interval_s_(interval_s) {}

  struct Verdict {
    bool pass = false;
    int held_back = 0;  ///< Suppressed since the last message that passed.
  };
  Verdict ask(const std::string& key, double now_s);

 private:
  struct Entry {
    double last_s = 0.0;
    int held_back = 0;
  };
  double interval_s_;
  std::map<std::string, Entry, std::less<>> entries_;
};

namespace log {

enum class Level { kError, kWarn, kInfo, kDebug };

/// One line, written as a whole when it goes out of scope: "12:00:01.123 warn pcm: text".
class Line {
 public:
  /// `key`, unless empty, limits the rate: see limited().
  Line(Level level, std::string_view tag, std::string key = {});
  ~Line();
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  template <typename T>
  Line& operator<<(const T& value) {
    if (enabled_) text_ << value;
    return *this;
  }

 private:
  Level level_;
  std::string tag_;
  std::string key_;
  bool enabled_;
  std::ostringstream text_;
};

/// The run is compromised.
inline Line error(std::string_view tag) {
  return {Level::kError, tag};
}
/// Data lost or refused.
inline Line warn(std::string_view tag) {
  return {Level::kWarn, tag};
}
/// A few lines per minute.
inline Line info(std::string_view tag) {
  return {Level::kInfo, tag};
}
inline Line debug(std::string_view tag) {
  return {Level::kDebug, tag};
}

/// At most one line per `key` in 5 s; the next one states how many were suppressed.
inline Line limited(Level level, std::string_view tag, std::string key) {
  return {level, tag, std::move(key)};
}

/// Lines less important than `level` are dropped. Default kInfo. Thread-safe.
void set_level(Level level);

struct Entry {
  Level level = Level::kInfo;
  std::string tag, text;
};

/// `listener` receives every line written from now on, one at a time, on the thread that writes it:
/// it must only enqueue, and not log. An empty one removes the listener. Thread-safe; after the
/// return the former listener is not called any more.
void set_listener(std::function<void(const Entry&)> listener);

/// Sets the output of log lines, by default unblocked_stderr(), so that no thread waits for the
/// reader of the log. Returns the former output. For tests.
std::ostream* set_output(std::ostream* output);

}  // namespace log

/// One line of state for a person: redrawn in place on a terminal, else printed plainly every few
/// seconds. Log lines are printed above it. One per process. Thread-safe.
class StatusLine {
 public:
  /// Writes to unblocked_stdout(); treats it as a terminal if isatty() is true.
  StatusLine();
  /// For tests: `output` outlives this.
  StatusLine(std::ostream& output, bool terminal, double plain_interval_s = 5.0);
  /// Leaves the last text on a line of its own.
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// Shows `text` (one line; cut to the terminal's width).
  void update(const std::string& text);
};

}  // namespace km
