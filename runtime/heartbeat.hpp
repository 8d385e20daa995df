#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <utility>

#include "runtime/thread.hpp"

namespace km {

/// Shows a watchdog whether a thread makes progress. A step that waits for its time, or for room in
/// the queue of another worker, does not count as stuck, because the other worker may be the cause.
/// A circular wait is therefore not detected. Thread-safe.
class Heartbeat {
 public:
  /// `give_up` is called, from another thread, when the step is abandoned: it releases the threads
  /// that wait for this one.
  explicit Heartbeat(std::function<void()> give_up = {}) : give_up_(std::move(give_up)) {}
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;

  /// One step of the calling thread, from here to the end of the scope.
  class Step {
   public:
    explicit Step(Heartbeat& heartbeat)
        : heartbeat_(heartbeat), outer_(std::exchange(current_, &heartbeat)) {
      heartbeat_.thread_ = this_thread_id();
      ++heartbeat_.beats_;
    }
    ~Step() {
      ++heartbeat_.beats_;
      current_ = outer_;
    }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;

   private:
    Heartbeat& heartbeat_;
    Heartbeat* const outer_;
  };

  /// Marks the calling thread's step, if there is one, as waiting until the end of the scope.
  class Waiting {
   public:
    Waiting() : step_(current_) {
      if (step_ != nullptr) step_->waiting_ = true;
    }
    ~Waiting() {
      if (step_ != nullptr) step_->waiting_ = false;
    }
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;

   private:
    Heartbeat* const step_;
  };

  /// Grows with the beginning and with the end of every step.
  [[nodiscard]] std::uint64_t beats() const { return beats_; }
  [[nodiscard]] bool in_step() const { return beats_ % 2 == 1; }
  [[nodiscard]] bool waiting() const { return waiting_; }
  /// The thread of the last step by this_thread_id(), 0 before the first one.
  [[nodiscard]] pid_t thread() const { return thread_; }

  void give_up() const {
    if (give_up_) give_up_();
  }

 private:
  static inline thread_local Heartbeat* current_ = nullptr;

  const std::function<void()> give_up_;
  std::atomic<std::uint64_t> beats_ = 0;
  std::atomic<bool> waiting_ = false;
  std::atomic<pid_t> thread_ = 0;
};

}  // namespace km
