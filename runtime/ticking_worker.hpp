#pragma once

#include <functional>
#include <string>
#include <utility>

#include "runtime/periodic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// A Worker with a clock that posts a tick into its queue at a fixed rate. It stops in the order of
/// Node::stop(). Declare it LAST in its node.
template <typename Input>
class TickingWorker {
 public:
  /// The clock's thread is named `name` + " tick". Throws under the conditions of Periodic.
  TickingWorker(std::size_t capacity, Overflow overflow, typename Worker<Input>::Handler handler,
                const std::string& name, Periodic::Duration period, std::function<Input()> tick)
      : worker_(capacity, overflow, std::move(handler), name),
        ticks_(
            period, [this, make = std::move(tick)] { worker_.post(make()); }, name + " tick") {}

  /// Starts both threads. Call once.
  void start() {
    worker_.start();
    ticks_.start();
  }

  /// Ends the ticks, processes the queued inputs, then joins. Idempotent. Not callable from the
  /// handler.
  void stop() noexcept {
    ticks_.stop();
    worker_.stop();
  }

  /// As Worker::post().
  bool post(Input input) { return worker_.post(std::move(input)); }

  /// The exception that ended a thread, or null. Thread-safe.
  std::exception_ptr error() const { return first_of({worker_.error(), ticks_.error()}); }

  Heartbeat& heartbeat() { return worker_.heartbeat(); }
  QueueLoad load() const { return worker_.load(); }
  DurationHistogram timing() const { return worker_.timing(); }

 private:
  Worker<Input> worker_;
  Periodic ticks_;  // last member: stops before the worker to which it posts
};

}  // namespace km
