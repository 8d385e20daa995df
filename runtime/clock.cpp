#include "runtime/clock.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace km {

double steady_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double wall_now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::chrono::steady_clock::duration steady_duration(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(s));
}

ReplayClock::ReplayClock(double rate) : rate_(rate) {
  if (!(rate > 0.0))
    throw std::invalid_argument("ReplayClock: rate " + std::to_string(rate) + " is not positive");
}

bool ReplayClock::wait_until(Stamp stamp) {
  std::unique_lock lock(mutex_);
  const TimePoint now = std::chrono::steady_clock::now();
  const auto due = due_locked(stamp, now);
  if (due) wake_.wait_until(lock, *due, [this] { return stopped_; });
  return !stopped_;
}

std::optional<ReplayClock::TimePoint> ReplayClock::due(Stamp stamp, TimePoint now) {
  const std::lock_guard lock(mutex_);
  return due_locked(stamp, now);
}

std::optional<ReplayClock::TimePoint> ReplayClock::due_locked(Stamp stamp, TimePoint now) {
  if (std::isinf(rate_)) return std::nullopt;
  if (!started_) {
    started_ = true;
    first_stamp_ = stamp;
    first_time_ = now;
  }
  return first_time_ + steady_duration(seconds_between(first_stamp_, stamp) / rate_);
}

std::optional<double> ReplayClock::due_s(Stamp stamp) {
  const auto instant = due(stamp, std::chrono::steady_clock::now());
  if (!instant) return std::nullopt;
  return std::chrono::duration<double>(instant->time_since_epoch()).count();
}

void ReplayClock::pause(double s) {
  const std::lock_guard lock(mutex_);
  first_time_ += steady_duration(s);
}

void ReplayClock::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  wake_.notify_all();
}

}  // namespace km
