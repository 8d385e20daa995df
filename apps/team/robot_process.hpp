#pragma once

#include <sys/types.h>

#include <array>
#include <csignal>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/io/descriptor.hpp"

namespace km {

/// Exit status of a process.
struct ProcessExit {
  int code = 0;    ///< Exit code; meaningless if `signal` is not 0.
  int signal = 0;  ///< Signal that ended it.

  [[nodiscard]] bool ok() const { return code == 0 && signal == 0; }
};

/// "exit code 3" or "ended by signal 9 (Killed)".
[[nodiscard]] std::string to_string(const ProcessExit& exit);

/// A child process with its output on pipes. Its standard input is empty. It has a process group of
/// its own, so that Ctrl-C of a terminal does not reach it. It receives SIGHUP when this program or
/// the thread that started it ends in any way. Not thread-safe.
class RobotProcess {
 public:
  /// Starts `command` (the program first), with the signals in `blocked` blocked and all others
  /// unblocked. Its output is also written to `log`. `prepare` runs in the new process before the
  /// program, and must be async-signal-safe; false, with errno, means that it failed. Throws
  /// std::runtime_error.
  RobotProcess(const std::vector<std::string>& command, const sigset_t& blocked,
               const std::filesystem::path& log, const std::function<bool()>& prepare = {});
  /// If the process is still running, sends SIGTERM, and kills it 20 s later.
  ~RobotProcess();
  RobotProcess(const RobotProcess&) = delete;
  RobotProcess& operator=(const RobotProcess&) = delete;

  /// File descriptors to poll for input; -1 once closed.
  [[nodiscard]] std::array<int, 2> descriptors() const { return {out_.fd.get(), err_.fd.get()}; }

  /// Reads the available output without waiting, and detects the end of the process. Returns the
  /// new lines of standard output.
  std::vector<std::string> read();

  /// Sends a signal if the process is still running.
  void send(int signal);

  /// Sends SIGTERM unless a signal was sent before: a second one ends a robot at once.
  void ask_to_end();

  /// Exit status; nullopt while the process runs or has unread output.
  [[nodiscard]] const std::optional<ProcessExit>& exit() const { return exit_; }

  /// The last lines of standard error.
  [[nodiscard]] const std::deque<std::string>& last_log_lines() const { return last_log_lines_; }

 private:
  struct Pipe {
    Descriptor fd;
    std::string partial;  // last line, not complete yet
  };
  std::vector<std::string> drain(Pipe& pipe);

  pid_t pid_ = -1;
  bool asked_ = false;  // true once any signal was sent
  Pipe out_;
  Pipe err_;
  std::ofstream log_;
  std::deque<std::string> last_log_lines_;
  std::optional<ProcessExit> exit_;
};

}  // namespace km
