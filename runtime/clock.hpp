#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// Steady time [s] with any origin.
[[nodiscard]] double steady_now_s();

/// Time since 1970 [s].
[[nodiscard]] double wall_now_s();

/// Seconds as a duration of the steady clock, for waits.
[[nodiscard]] std::chrono::steady_clock::duration steady_duration(double s);

/// Paces the playing of a recording: sensor time passes `rate` times as fast as real time, from
/// the first requested stamp. Thread-safe.
class ReplayClock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// An infinite `rate` never waits. Throws std::invalid_argument unless `rate` is positive.
  explicit ReplayClock(double rate);

  /// Waits until `stamp` is due. False if stopped: the source should end.
  bool wait_until(Stamp stamp);

  /// Time at which `stamp` is due; the first call, at `now`, fixes the origin. nullopt: at once.
  [[nodiscard]] std::optional<TimePoint> due(Stamp stamp, TimePoint now);

  /// Time at which `stamp` is due, in the time of steady_now_s(). nullopt: at once.
  [[nodiscard]] std::optional<double> due_s(Stamp stamp);

  /// Delays all later waits by `s` seconds; a wait that has begun is unchanged.
  void pause(double s);

  /// Ends every wait, now and later. Idempotent.
  void stop();

 private:
  std::optional<TimePoint> due_locked(Stamp stamp, TimePoint now);

  const double rate_;
  mutable std::mutex mutex_;  // guards the members below
  std::condition_variable wake_;
  bool started_ = false;
  bool stopped_ = false;
  Stamp first_stamp_ = 0;
  TimePoint first_time_;
};

}  // namespace km
