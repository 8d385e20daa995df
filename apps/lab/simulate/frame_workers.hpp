#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace km {

/// Threads that take the numbers 0 .. count - 1 in turn and call `body` with each. The first
/// exception, or stop(), ends them after the running calls.
class FrameWorkers {
 public:
  FrameWorkers(int threads, std::size_t count, std::function<void(std::size_t)> body)
      : count_(count), body_(std::move(body)) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
  }
  ~FrameWorkers() {
    stop();
    wait();
  }
  FrameWorkers(const FrameWorkers&) = delete;
  FrameWorkers& operator=(const FrameWorkers&) = delete;

  void stop() { stopped_ = true; }

  /// True when no call is running and none will follow.
  [[nodiscard]] bool is_finished() const { return idle_ == threads_.size(); }

  /// Waits for the running calls; rethrows the exception of a call.
  void join() {
    wait();
    if (const std::exception_ptr error = std::exchange(error_, nullptr))
      std::rethrow_exception(error);
  }

 private:
  void wait() {
    for (std::thread& thread : threads_)
      if (thread.joinable()) thread.join();
  }

  void run() {
    try {
      while (!stopped_) {
        const std::size_t i = next_++;
        if (i >= count_) break;
        body_(i);
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      stopped_ = true;
    }
    ++idle_;
  }

  const std::size_t count_;
  const std::function<void(std::size_t)> body_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<std::size_t> idle_ = 0;
  std::atomic<bool> stopped_ = false;
  std::mutex mutex_;  // guards error_ until the threads are joined
  std::exception_ptr error_;
  std::vector<std::thread> threads_;
};

}  // namespace km
