#pragma once

#include <sys/types.h>

#include <array>
#include <csignal>
#include <deque>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "apps/team/robot_network.hpp"

namespace km {

/// How a process ended.
struct ProcessExit {
  int code = 0;    ///< Exit code; meaningless if `signal` is not 0.
  int signal = 0;  ///< Signal that ended it.

  [[nodiscard]] bool ok() const { return code == 0 && signal == 0; }
};

/// "exit code 3" or "ended by signal 9 (Killed)".
[[nodiscard]] std::string to_string(const ProcessExit& exit);

/// A child process with its output on pipes. Its standard input is empty, it is in a process group
/// of its own (so that a terminal's Ctrl-C does not reach it), and it is sent SIGHUP if this
/// program, or the thread that started it, ends first, however it ends. Not thread-safe.
class RobotProcess {
 public:
  /// Starts `command` (the program first), with the signals in `blocked` blocked and all others
  /// free, in `network` if it is to have one of its own. What it prints also goes to `log`. Throws
  /// std::runtime_error.
  RobotProcess(const std::vector<std::string>& command, const sigset_t& blocked,
               const std::filesystem::path& log, const RobotNetwork* network = nullptr);
  /// If it is still running, asks it to end and kills it 20 s later.
  ~RobotProcess();
  RobotProcess(const RobotProcess&) = delete;
  RobotProcess& operator=(const RobotProcess&) = delete;

  /// File descriptors to poll for input; -1 once closed.
  [[nodiscard]] std::array<int, 2> descriptors() const { return {out_.fd, err_.fd}; }

  /// Takes what it printed without waiting, and notes its end. Returns the new lines of standard
  /// output.
  std::vector<std::string> read();

  /// Sends a signal if it is still running.
  void send(int signal);

  /// Sends SIGTERM, unless it has been sent a signal before: a second one ends a robot at once.
  void ask_to_end();

  /// How it ended; nullopt while it runs or has output left.
  [[nodiscard]] const std::optional<ProcessExit>& exit() const { return exit_; }

  /// The last lines of standard error.
  [[nodiscard]] const std::deque<std::string>& last_words() const { return last_words_; }

 private:
  struct Pipe {
    int fd = -1;
    std::string partial;  // a line not complete yet
  };
  std::vector<std::string> drain(Pipe& pipe);

  pid_t pid_ = -1;
  bool asked_ = false;  // to end, by some signal
  Pipe out_;
  Pipe err_;
  std::ofstream log_;
  std::deque<std::string> last_words_;
  std::optional<ProcessExit> exit_;
};

}  // namespace km
