#pragma once

#include <csignal>
#include <optional>

namespace km {

/// Blocks SIGINT, SIGTERM and, unless it is ignored (nohup), SIGHUP, so that wait() receives them.
/// Ignores SIGPIPE, so that writing to a closed pipe is an error. Construct it before any other
/// thread exists, because threads inherit the blocked signals. Child programs inherit blocked and
/// ignored signals, unless their parent restores previous() and the default of SIGPIPE.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  /// Waits up to `timeout_s` for a signal; its number, or nullopt.
  std::optional<int> wait(double timeout_s);

  /// Restores the default: SIGINT and SIGTERM now end the process at once. SIGHUP has no effect any
  /// more, because a closing terminal may send it several times.
  void give_up();

  /// The signals that were blocked before.
  [[nodiscard]] const sigset_t& previous() const { return previous_; }

 private:
  sigset_t watched_{};
  sigset_t previous_{};
  void (*previous_pipe_)(int) = nullptr;    // former handler of SIGPIPE
  void (*previous_hangup_)(int) = nullptr;  // former handler of SIGHUP
};

}  // namespace km
