#include "apps/lab/simulation/motion/robot_clock.hpp"

#include <algorithm>
#include <cmath>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

// Error of a clock that runs since `start` with the drift `drift` [ns].
Stamp drifted(Stamp start, Stamp true_time, double drift) {
  return std::llround(drift * static_cast<double>(true_time - start));
}

}  // namespace

RobotClock::RobotClock(const TimingErrorConfig& config, Stamp start, Stamp end, std::uint64_t seed)
    : start_(start) {
  checked(config);
  SeededRandom random(seed);
  drift_ = static_cast<double>(random.sign()) * config.drift_ppm * 1e-6;
  camera_drift_ = static_cast<double>(random.sign()) * config.camera_drift_ppm * 1e-6;
  jump_ = nanoseconds(config.jump_s);
  delay_ = nanoseconds(config.camera_delay_s);
  if (!(config.jump_every_s > 0.0) || jump_ == 0) return;
  // Intervals from half to one and a half of the mean.
  for (Stamp at = start;;) {
    at += nanoseconds(config.jump_every_s * (0.5 + random.unit()));
    if (at > end) return;
    jumps_.push_back(at);
  }
}

Stamp RobotClock::inertial(Stamp true_time) const {
  const auto past = std::upper_bound(jumps_.begin(), jumps_.end(), true_time) - jumps_.begin();
  return true_time + drifted(start_, true_time, drift_) + static_cast<Stamp>(past) * jump_;
}

Stamp RobotClock::camera(Stamp true_time) const {
  return inertial(true_time) + drifted(start_, true_time, camera_drift_) + delay_;
}

std::vector<Stamp> without_dropped(const std::vector<Stamp>& images,
                                   const TimingErrorConfig& config, std::uint64_t seed) {
  checked(config);
  if (!(config.dropped_share > 0.0)) return images;
  // In balance as many runs of losses begin as end: share / run = (1 - share) * begin.
  const double begin = config.dropped_share / (config.dropped_run * (1.0 - config.dropped_share));
  const double go_on = 1.0 - 1.0 / config.dropped_run;
  SeededRandom random(seed);
  std::vector<Stamp> kept;
  bool lost = false;
  for (const Stamp stamp : images) {
    lost = random.chance(lost ? go_on : begin) && !kept.empty();
    if (!lost) kept.push_back(stamp);
  }
  return kept;
}

}  // namespace km
