#include "runtime/unblocked_output.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>

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

using Pool = spdlog::details::thread_pool;

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

// Queue of the text of both streams, so that their order is kept, and the thread that writes it.
struct OutputQueue {
  static constexpr std::size_t kTexts = 4096;

  // Without signals, a closed pipe is an error of write() and does not end the process.
  std::shared_ptr<Pool> pool = std::make_shared<Pool>(kTexts, 1, [] {
    block_signals();
    name_this_thread("output");
  });
  std::uint64_t failed = 0, reported = 0;  // lost lines; used by the thread only
};

class DescriptorSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  DescriptorSink(int descriptor, OutputQueue& queue) : descriptor_(descriptor), queue_(queue) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::uint64_t lost = queue_.failed + queue_.pool->overrun_counter() - queue_.reported;
    if (lost > 0 && write_all(descriptor_, std::to_string(lost) + (lost == 1 ? " line" : " lines") +
                                               " lost: output blocked or failed\n"))
      queue_.reported += lost;
    if (!write_all(descriptor_, {message.payload.data(), message.payload.size()})) ++queue_.failed;
  }
  void flush_() override {}

  const int descriptor_;
  OutputQueue& queue_;
};

// Queues the written text at every flush.
class OutputBuffer final : public std::stringbuf {
 public:
  OutputBuffer(int descriptor, OutputQueue& queue)
      : std::stringbuf(std::ios::out),
        logger_(std::make_shared<spdlog::async_logger>(
            "", std::make_shared<DescriptorSink>(descriptor, queue), queue.pool,
            spdlog::async_overflow_policy::overrun_oldest)) {}

  // Queues a mark that the thread takes when it has written the texts before it.
  void mark() { logger_->flush(); }

 private:
  int sync() override {
    const std::string text = str();
    if (!text.empty()) logger_->log(spdlog::level::info, spdlog::string_view_t(text));
    str({});
    return 0;
  }

  const std::shared_ptr<spdlog::async_logger> logger_;
};

struct StandardStreams {
  OutputQueue queue;
  OutputBuffer out_buffer{STDOUT_FILENO, queue};
  OutputBuffer err_buffer{STDERR_FILENO, queue};
  std::ostream out{&out_buffer};
  std::ostream err{&err_buffer};
};

StandardStreams& standard_streams() {
  // Never destroyed: destructors may log while the program ends, and the thread may be blocked.
  static auto* const streams = new StandardStreams;
  static const struct AtExit {
    ~AtExit() { drain_standard_output(); }
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
  constexpr double kGrace_s = 2.0;
  StandardStreams& streams = standard_streams();
  streams.out.flush();
  streams.err.flush();
  streams.err_buffer.mark();
  const double end_s = steady_now_s() + kGrace_s;
  while (streams.queue.pool->queue_size() > 0 && steady_now_s() < end_s)
    std::this_thread::sleep_for(steady_duration(0.002));
}

}  // namespace km
