#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <string>

#include "runtime/guarded_thread.hpp"

namespace km {

/// Calls `tick` on its own thread at a fixed rate; after stop() no further tick begins. A tick that
/// takes too long delays the following ones, and missed ticks are not repeated. `tick` should post
/// into a worker rather than compute.
class Periodic {
 public:
  using Duration = std::chrono::steady_clock::duration;

  /// Throws std::invalid_argument unless `period` is positive.
  Periodic(Duration period, std::function<void()> tick, std::string name = {});
  ~Periodic() { stop(); }
  Periodic(const Periodic&) = delete;
  Periodic& operator=(const Periodic&) = delete;

  /// The first tick follows at once. Call once.
  void start();

  /// Waits for a tick that is running. Idempotent. Not callable from the tick.
  void stop() noexcept;

  /// The exception that ended the thread, or null. Thread-safe.
  std::exception_ptr error() const { return thread_.error(); }

 private:
  void run();

  const Duration period_;
  const std::function<void()> tick_;
  const std::string name_;
  std::mutex mutex_;  // guards stop_
  std::condition_variable wake_;
  bool stop_ = false;
  GuardedThread thread_;
};

}  // namespace km
