#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <initializer_list>
#include <string>
#include <thread>
#include <utility>

#include "runtime/thread.hpp"

namespace km {

/// A thread of a node. An exception ends the thread, but not the process: it is kept for
/// Node::error(), and the supervisor then reports the node's name and ends the robot. Every thread
/// of a node is one of these, also inside Worker and Periodic.
class GuardedThread {
 public:
  using Work = std::function<void()>;

  GuardedThread() = default;
  ~GuardedThread() { join(); }
  GuardedThread(const GuardedThread&) = delete;
  GuardedThread& operator=(const GuardedThread&) = delete;

  /// Starts `work` on a thread called `name`, for debuggers. If `work` throws, the thread then
  /// calls `on_failure`, for example to release threads that wait for it. Call once.
  void start(const std::string& name, Work work, Work on_failure = {}) {
    thread_ = std::thread([this, name, work = std::move(work), on_failure = std::move(on_failure)] {
      try {
        name_this_thread(name);
        work();
      } catch (...) {
        error_ = std::current_exception();
        failed_ = true;  // set after error_, so that readers of the flag see the error
        if (on_failure) on_failure();
      }
    });
  }

  /// True between start() and join().
  [[nodiscard]] bool joinable() const { return thread_.joinable(); }

  /// Waits for the end of the thread. Idempotent.
  void join() noexcept {
    if (thread_.joinable()) thread_.join();
  }

  /// The exception that ended the thread, or null. Thread-safe.
  [[nodiscard]] std::exception_ptr error() const { return failed_ ? error_ : nullptr; }

 private:
  std::exception_ptr error_;
  std::atomic<bool> failed_ = false;
  std::thread thread_;
};

/// The first of `errors` that is not null, or null.
[[nodiscard]] inline std::exception_ptr first_of(std::initializer_list<std::exception_ptr> errors) {
  for (const std::exception_ptr& error : errors)
    if (error != nullptr) return error;
  return nullptr;
}

}  // namespace km
