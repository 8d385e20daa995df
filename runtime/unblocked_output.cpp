#include "runtime/unblocked_output.hpp"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <sstream>
#include <string>

// Header only, because this is the only file that uses spdlog: nothing else waits for its headers.
#define SPDLOG_FMT_EXTERNAL
#define FMT_HEADER_ONLY
#include <spdlog/async_logger.h>
#include <spdlog/details/thread_pool.h>
#include <spdlog/sinks/base_sink.h>

#include "runtime/clock.hpp"
#include "runtime/thread.hpp"

namespace km {
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

std::uint64_t lines_of(std::string_view text) {
  return std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n')));
}

// Used on the thread of spdlog only, except for the members that say so.
class DescriptorSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}

  // Discards what follows, because the descriptor may be reused for another file. Thread-safe.
  void close() { closed_ = true; }
  // False if the first `count` texts and flushes are not written or lost after `grace_s`.
  // Thread-safe.
  bool wait_for(std::uint64_t count, double grace_s) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, steady_duration(grace_s),
                             [&] { return handled_ + overrun_() >= count; });
  }
  void set_overrun(std::function<std::size_t()> overrun) { overrun_ = std::move(overrun); }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (closed_) return;
    const std::string_view text(message.payload.data(), message.payload.size());
    report_losses();
    if (!write_all(descriptor_, text)) failed_ += lines_of(text);
    count();
  }
  void flush_() override {
    if (closed_) return;
    report_losses();
    count();
  }
  void count() {
    const std::lock_guard lock(mutex_);
    ++handled_;
    changed_.notify_all();
  }
  void report_losses() {
    const std::uint64_t lost = failed_ + overrun_() - reported_;
    if (lost == 0) return;
    if (write_all(descriptor_, std::to_string(lost) + (lost == 1 ? " line" : " lines") +
                                   " lost: output blocked or failed\n"))
      reported_ += lost;
  }

  const int descriptor_;
  std::function<std::size_t()> overrun_;  // number of texts that made room for newer ones
  std::uint64_t failed_ = 0, reported_ = 0;
  std::atomic<bool> closed_ = false;
  std::mutex mutex_;  // guards handled_
  std::condition_variable changed_;
  std::uint64_t handled_ = 0;  // texts and flushes
};

}  // namespace

struct UnblockedOutput::Queue {
  Queue(int descriptor, std::size_t capacity)
      : sink(std::make_shared<DescriptorSink>(descriptor)),
        // Without signals, a closed pipe is an error of write() and does not end the process.
        pool([&] {
          const SignalsBlocked blocked;
          return std::make_shared<spdlog::details::thread_pool>(capacity, 1,
                                                                [] { name_this_thread("output"); });
        }()),
        logger(std::make_shared<spdlog::async_logger>(
            "", sink, pool, spdlog::async_overflow_policy::overrun_oldest)) {
    sink->set_overrun([queue = pool.get()] { return queue->overrun_counter(); });
  }

  const std::shared_ptr<DescriptorSink> sink;
  const std::shared_ptr<spdlog::details::thread_pool> pool;
  const std::shared_ptr<spdlog::async_logger> logger;
  std::atomic<std::uint64_t> posted = 0;  // texts and flushes
};

UnblockedOutput::UnblockedOutput(int descriptor, std::size_t capacity)
    : queue_(std::make_shared<Queue>(descriptor, capacity)) {}

UnblockedOutput::~UnblockedOutput() {
  if (drain()) return;
  queue_->sink->close();
  new std::shared_ptr<Queue>(std::move(queue_));  // never destroyed: its thread may never end
}

void UnblockedOutput::write(std::string_view text) {
  ++queue_->posted;
  queue_->logger->log(spdlog::level::info, spdlog::string_view_t(text.data(), text.size()));
}

bool UnblockedOutput::drain(double grace_s) {
  const std::uint64_t count = ++queue_->posted;
  queue_->logger->flush();  // reports losses
  return queue_->sink->wait_for(count, grace_s);
}

namespace {

// Forwards the written text at every flush.
class OutputBuffer final : public std::stringbuf {
 public:
  explicit OutputBuffer(UnblockedOutput& output) : std::stringbuf(std::ios::out), to_(output) {}

 private:
  int sync() override {
    if (const std::string text = str(); !text.empty()) to_.write(text);
    str({});
    return 0;
  }

  UnblockedOutput& to_;
};

bool are_same_file(int a, int b) {
  struct stat of_a {};
  struct stat of_b {};
  return fstat(a, &of_a) == 0 && fstat(b, &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

struct StandardStreams {
  std::shared_ptr<UnblockedOutput> to_out = std::make_shared<UnblockedOutput>(STDOUT_FILENO);
  std::shared_ptr<UnblockedOutput> to_err = are_same_file(STDOUT_FILENO, STDERR_FILENO)
                                                ? to_out
                                                : std::make_shared<UnblockedOutput>(STDERR_FILENO);
  OutputBuffer out_buffer{*to_out};
  OutputBuffer err_buffer{*to_err};
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
  const StandardStreams& streams = standard_streams();
  streams.to_out->drain();
  if (streams.to_err != streams.to_out) streams.to_err->drain();
}

}  // namespace km
