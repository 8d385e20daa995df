#pragma once

#include <cstddef>
#include <memory>
#include <ostream>
#include <string_view>

namespace km {

/// Writes text to a file descriptor on a thread of its own, so that callers never wait for a
/// terminal, a pipe or a disk. If too many texts wait, the oldest ones are lost. Lines that are
/// lost, or cannot be written, are counted: "12 lines lost: output blocked or failed" stands in
/// their place. Thread-safe.
class UnblockedOutput {
 public:
  /// `descriptor` stays open as long as this object exists. At most `capacity` texts wait.
  explicit UnblockedOutput(int descriptor, std::size_t capacity = 4096);
  /// Calls drain(). A thread that is then still blocked is abandoned.
  ~UnblockedOutput();
  UnblockedOutput(const UnblockedOutput&) = delete;
  UnblockedOutput& operator=(const UnblockedOutput&) = delete;

  static constexpr double kGrace_s = 2.0;

  /// Queues `text`, whole lines. Never waits.
  void write(std::string_view text);

  /// Waits until everything queued has been written or has failed; false after `grace_s`.
  bool drain(double grace_s = kGrace_s);

 private:
  struct Queue;  // of spdlog
  std::shared_ptr<Queue> queue_;
};

/// Standard output and standard error, each through an UnblockedOutput, or through a common one if
/// they are the same file, so that the order is kept. A flush forwards the text since the last one.
/// The program's end waits for the queued text, at most UnblockedOutput::kGrace_s. Each stream is
/// for one thread at a time.
std::ostream& unblocked_stdout();
std::ostream& unblocked_stderr();

/// Waits until both streams are written, at most UnblockedOutput::kGrace_s each.
void drain_standard_output();

}  // namespace km
