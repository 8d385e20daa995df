#pragma once

#include <sys/types.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "test/support/patience.hpp"

namespace km {

/// A line a process printed, and when this process read it.
struct TimedLine {
  std::string text;
  std::chrono::steady_clock::time_point time;
};

/// The command with its log, which is on standard error, among the lines of its standard output.
inline std::vector<std::string> logged(const std::vector<std::string>& command) {
  std::vector<std::string> shell = {"sh", "-c", R"(exec "$0" "$@" 2>&1)"};
  shell.insert(shell.end(), command.begin(), command.end());
  return shell;
}

/// A child process. The destructor kills it if it still runs. Its output is read line by line, or
/// goes to a descriptor.
class Process {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Starts `command` (program and arguments; stderr is shared), in the network namespace of
  /// process `network_of` if that is not 0. With `output`, standard output and error go there.
  explicit Process(const std::vector<std::string>& command, pid_t network_of = 0,
                   std::optional<int> output = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] TimePoint started() const { return started_; }

  /// Writes a line to its standard input.
  void send_line(const std::string& line);

  /// Waits until it has printed `line` `times` times; the last of them, or nullopt after
  /// `patience`.
  std::optional<TimedLine> wait_for(const std::string& line, std::size_t times = 1,
                                    std::chrono::seconds patience = kPatience);

  /// Waits for a line that begins so.
  std::optional<TimedLine> wait_for_prefix(const std::string& prefix);

  /// Waits for a line of which `accepts` is true.
  std::optional<TimedLine> wait_until(const std::function<bool(const std::string&)>& accepts);

  /// Lines so far that begin so.
  [[nodiscard]] std::vector<TimedLine> lines(const std::string& prefix = {}) const;

  void kill(int signal) const;

  /// Waits for its end: the exit code, or minus the signal that killed it. All that it has printed
  /// is then in lines().
  int wait();

  /// As wait(); nullopt if it still runs after `patience`.
  std::optional<int> wait_within(std::chrono::seconds patience);

 private:
  void keep_result(int status);
  void read_lines();

  TimePoint started_;
  pid_t pid_ = -1;
  int input_ = -1;
  int output_ = -1;
  std::optional<int> result_;
  mutable std::mutex mutex_;  // guards lines_ and ended_
  std::condition_variable changed_;
  std::vector<TimedLine> lines_;
  bool ended_ = false;
  std::thread reader_;
};

}  // namespace km
