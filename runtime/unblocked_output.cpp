#include "runtime/unblocked_output.hpp"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <sstream>
#include <string_view>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/thread.hpp"

namespace km {

struct OutputQueue::State {
  struct Piece {
    std::string text;
    std::uint64_t lines = 0;  // lines of `text`, counted as lost if it cannot be written
  };

  State(int descriptor_, std::size_t capacity_) : descriptor(descriptor_), capacity(capacity_) {}

  const int descriptor;
  const std::size_t capacity;  // [bytes]
  std::mutex mutex;            // guards the members below
  std::condition_variable changed;
  std::deque<Piece> waiting;
  std::size_t bytes = 0;  // bytes that wait or are being written
  std::uint64_t lost = 0;
  bool writing = false;
  bool closed = false;

  void push(std::string text, std::uint64_t lines) {
    bytes += text.size();
    waiting.push_back({std::move(text), lines});
    changed.notify_all();
  }
  void report_losses() {
    const std::uint64_t lines = std::exchange(lost, 0);
    if (lines > 0)
      push(std::to_string(lines) + (lines == 1 ? " line" : " lines") +
               " lost: output blocked or failed\n",
           lines);
  }
  void run();
};

namespace {

// Blocks while the reader does not read. False if the rest cannot be written.
bool write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(descriptor, text.data(), text.size());
    if (n > 0) {
      text.remove_prefix(static_cast<std::size_t>(n));
    } else if (n < 0 && errno == EAGAIN) {  // another process made it non-blocking
      pollfd room{descriptor, POLLOUT, 0};
      poll(&room, 1, -1);
    } else if (n == 0 || errno != EINTR) {
      return false;
    }
  }
  return true;
}

}  // namespace

void OutputQueue::State::run() {
  name_this_thread("output");
  std::unique_lock lock(mutex);
  while (true) {
    changed.wait(lock, [this] { return closed || !waiting.empty(); });
    if (waiting.empty()) return;
    const Piece piece = std::move(waiting.front());
    waiting.pop_front();
    writing = true;
    lock.unlock();
    const bool written = write_all(descriptor, piece.text);
    lock.lock();
    writing = false;
    bytes -= piece.text.size();
    if (!written)
      lost += piece.lines;
    else if (waiting.empty())
      report_losses();
    changed.notify_all();
  }
}

OutputQueue::OutputQueue(int descriptor, std::size_t capacity_bytes)
    : state_(std::make_shared<State>(descriptor, capacity_bytes)),
      // Without signals, a closed pipe is an error of write() and does not end the process.
      writer_(start_without_signals([state = state_] { state->run(); })) {}

OutputQueue::~OutputQueue() {
  const bool drained = drain(kGrace_s);
  {
    const std::lock_guard lock(state_->mutex);
    state_->closed = true;
    state_->waiting.clear();  // because `descriptor` may be reused for another file
    state_->changed.notify_all();
  }
  if (drained)
    writer_.join();
  else
    writer_.detach();
}

void OutputQueue::write(std::string text) {
  const auto lines = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n')));
  const std::lock_guard lock(state_->mutex);
  if (state_->bytes + text.size() > state_->capacity) {
    state_->lost += lines;
    return;
  }
  state_->report_losses();
  state_->push(std::move(text), lines);
}

bool OutputQueue::drain(double grace_s) {
  std::unique_lock lock(state_->mutex);
  return state_->changed.wait_for(lock, steady_duration(grace_s),
                                  [this] { return state_->waiting.empty() && !state_->writing; });
}

namespace {

// Forwards the written text at every flush.
class QueueBuffer final : public std::stringbuf {
 public:
  explicit QueueBuffer(OutputQueue& queue) : std::stringbuf(std::ios::out), queue_(queue) {}

 private:
  int sync() override {
    if (std::string text = str(); !text.empty()) queue_.write(std::move(text));
    str({});
    return 0;
  }

  OutputQueue& queue_;
};

bool are_same_file(int a, int b) {
  struct stat of_a {};
  struct stat of_b {};
  return fstat(a, &of_a) == 0 && fstat(b, &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

struct StandardStreams {
  std::shared_ptr<OutputQueue> out_queue = std::make_shared<OutputQueue>(STDOUT_FILENO);
  std::shared_ptr<OutputQueue> err_queue = are_same_file(STDOUT_FILENO, STDERR_FILENO)
                                               ? out_queue
                                               : std::make_shared<OutputQueue>(STDERR_FILENO);
  QueueBuffer out_buffer{*out_queue};
  QueueBuffer err_buffer{*err_queue};
  std::ostream out{&out_buffer};
  std::ostream err{&err_buffer};
};

StandardStreams& standard_streams() {
  // Never destroyed, because destructors may log while the program ends.
  static auto* const streams = new StandardStreams;
  static const struct AtExit {
    ~AtExit() {
      streams->out.flush();
      streams->err.flush();
      drain_standard_output();
    }
  } at_exit;
  return *streams;
}

}  // namespace

std::ostream& unblocked_stdout() {
  return standard_streams().out;
}

std::ostream& unblocked_stderr() {
  return standard_streams().err;
}

void drain_standard_output() {
  const double end_s = steady_now_s() + OutputQueue::kGrace_s;
  for (OutputQueue* queue :
       {standard_streams().out_queue.get(), standard_streams().err_queue.get()})
    queue->drain(std::max(0.0, end_s - steady_now_s()));
}

}  // namespace km
