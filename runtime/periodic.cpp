#include "runtime/periodic.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace km {

Periodic::Periodic(Duration period, std::function<void()> tick, std::string name)
    : period_(period), tick_(std::move(tick)), name_(std::move(name)) {
  if (period <= Duration::zero()) throw std::invalid_argument("Periodic: period is not positive");
}

void Periodic::start() {
  thread_.start(name_, [this] { run(); });
}

void Periodic::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Periodic::run() {
  auto next = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  while (!stop_) {
    lock.unlock();
    tick_();
    lock.lock();
    next = std::max(next + period_, std::chrono::steady_clock::now());
    wake_.wait_until(lock, next, [this] { return stop_; });
  }
}

}  // namespace km
