#pragma once

#include <cstddef>
#include <memory>
#include <ostream>
#include <string>
#include <thread>

namespace km {

/// Writes text to a file descriptor on a thread of its own, so that callers never wait for a
/// terminal, a pipe or a disk. Text that does not fit, or cannot be written, is lost and counted:
/// "12 lines lost: output blocked or failed" stands in its place. Thread-safe.
class OutputQueue {
 public:
  /// `descriptor` stays open as long as this object exists. It is not changed to non-blocking,
  /// because other processes may share it.
  explicit OutputQueue(int descriptor, std::size_t capacity_bytes = std::size_t{1} << 20);
  /// Calls drain(kGrace_s). A thread that is then still blocked is detached.
  ~OutputQueue();
  OutputQueue(const OutputQueue&) = delete;
  OutputQueue& operator=(const OutputQueue&) = delete;

  static constexpr double kGrace_s = 2.0;

  /// Queues `text`, whole lines. Never waits.
  void write(std::string text);

  /// Waits until everything queued has been written or has failed; false after `grace_s`.
  bool drain(double grace_s);

 private:
  struct State;
  std::shared_ptr<State> state_;  // shared with the thread, which may outlive this
  std::thread writer_;
};

/// Standard output and standard error, each through an OutputQueue, or through a common one if they
/// are the same file, so that the order is kept. A flush forwards the text since the last one. The
/// program's end waits for the queued text, at most OutputQueue::kGrace_s. Text written directly to
/// std::cout or std::cerr may appear out of order, unless drain_standard_output() is called before.
/// Each stream is for one thread at a time.
std::ostream& unblocked_stdout();
std::ostream& unblocked_stderr();

/// Waits until both streams are written, at most OutputQueue::kGrace_s.
void drain_standard_output();

}  // namespace km
