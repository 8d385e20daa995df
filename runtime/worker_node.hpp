#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/clock.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/thread.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Input of a node at each tick of its clock. It is a pointer that is always null and not a struct,
/// because GCC 12 reports a false warning for a variant of structs and pointers.
using Tick = std::shared_ptr<const struct TickTag>;

struct WorkerOptions {
  std::string name;       ///< Node::name(), and name of the thread.
  std::size_t queue = 1;  ///< Capacity of the queue.
  Overflow overflow = Overflow::kBlock;
  /// Period at which a clock posts Input(), unless one waits in the queue; 0: there is no clock.
  double tick_s = 0.0;
  bool in_background = false;          ///< See work_in_background().
  double step_limit_s = kStepLimit_s;  ///< See Node::step_limit_s().
};

/// A node with one Worker, which calls handle() for each input, and perhaps a clock. It owns start,
/// stop, errors and heartbeats. A node with several kinds of input has a std::variant as Input.
///
/// A derived class subscribes in its constructor and calls stop() in its destructor, because the
/// worker must stop before the state on which it works is destroyed.
template <typename InputType>
class WorkerNode : public Node {
 public:
  using Input = InputType;

  ~WorkerNode() override { assert(!is_running_); }
  WorkerNode(const WorkerNode&) = delete;
  WorkerNode& operator=(const WorkerNode&) = delete;

  std::string_view name() const final { return options_.name; }
  void start() final {
    is_running_ = true;
    worker_.start();
    if (ticks_) ticks_->start();
    start_sources();
  }
  void stop() noexcept final {
    stop_sources();
    if (ticks_) ticks_->stop();
    worker_.stop();
    is_running_ = false;
    if (!std::exchange(has_concluded_, true) && error() == nullptr) conclude();
  }
  std::exception_ptr error() const override {
    return first_of({worker_.error(), ticks_ ? ticks_->error() : nullptr});
  }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  double step_limit_s() const final { return options_.step_limit_s; }
  DurationHistogram timing() const override { return worker_.timing(); }

 protected:
  explicit WorkerNode(WorkerOptions options)
      : options_(std::move(options)),
        worker_(
            options_.queue, options_.overflow,
            [this](const Input& input) {
              if (may_be_tick(input)) tick_waits_ = false;  // another one may wait from now on
              if (options_.in_background) work_in_background();
              handle(input);
            },
            options_.name) {
    if (options_.tick_s > 0.0)
      ticks_.emplace(
          steady_duration(options_.tick_s),
          [this] {
            // A queue that drops its oldest input can lose a tick.
            const bool waits = tick_waits_.exchange(true);
            if (!waits || options_.overflow == Overflow::kDropOldest) post(Input());
          },
          options_.name + " tick");
  }

  /// As Worker::post() and Worker::load().
  bool post(Input input) { return worker_.post(std::move(input)); }
  [[nodiscard]] QueueLoad load() const { return worker_.load(); }

  /// Posts the messages of these topics.
  template <typename... T>
  void follow(const In<T>&... topics) {
    (topics.subscribe([this](const auto& message) { post(message); }), ...);
  }

 private:
  /// Handles one input. The thread calls only this function.
  virtual void handle(const Input& input) = 0;
  /// Starts further threads that post inputs.
  virtual void start_sources() {}
  /// Ends these threads. They may wait for room in the queue, because the worker still runs.
  virtual void stop_sources() noexcept {}
  /// Does the remaining work after the last input, unless the node has failed. Called once.
  virtual void conclude() {}

  // Ticks are the first alternative of a variant. Without a variant every input may be one.
  static bool may_be_tick(const Input& input) {
    if constexpr (requires { input.index(); }) return input.index() == 0;
    return true;
  }

  const WorkerOptions options_;
  bool is_running_ = false, has_concluded_ = false;
  std::atomic<bool> tick_waits_ = false;
  Worker<Input> worker_;
  std::optional<Periodic> ticks_;  // last member: stops before the worker to which it posts
};

}  // namespace km
