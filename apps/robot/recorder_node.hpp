#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string_view>

#include "apps/robot/run_record.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Keeps what the other nodes publish, for the status line and the result files.
class RecorderNode final : public Node {
 public:
  explicit RecorderNode(RobotId robot);
  ~RecorderNode() override { stop(); }

  /// Records everything published on `topic`, for any T that RunRecord takes.
  template <typename T>
  void record(Topic<T>& topic) {
    record(In<T>(topic));
  }
  template <typename T>
  void record(In<T> topic) {
    topic.subscribe([this](const std::shared_ptr<const T>& message) {
      worker_.post([this, message] {
        if (!frozen_) record_.add(*message);
      });
    });
  }

  /// What comes from now on is not recorded: the robot leaves with what it has. Thread-safe.
  void freeze() { frozen_ = true; }

  /// Calls `read` with the record, which no other thread changes meanwhile. Thread-safe.
  template <typename Reader>
  auto with_record(const Reader& read) const {
    const std::lock_guard lock(mutex_);
    return read(record_);
  }

  std::string_view name() const override { return "recorder"; }
  void start() override { worker_.start(); }
  void stop() noexcept override { worker_.stop(); }
  std::exception_ptr error() const override { return worker_.error(); }
  DurationHistogram timing() const override { return worker_.timing(); }

 private:
  using Input = std::function<void()>;

  mutable std::mutex mutex_;  // guards record_
  RunRecord record_;
  std::atomic<bool> frozen_ = false;
  Worker<Input> worker_;  // last member: stops first
};

}  // namespace km
