#pragma once

#include <algorithm>
#include <cstddef>

namespace km {

/// When a robot refines its poses alone between sessions: when it has new closures, at most once
/// per period, and for at most a twentieth of its time. Not thread-safe.
class RefinementSchedule {
 public:
  /// `period_s`: shortest time between two refinements; 0: there are none.
  explicit RefinementSchedule(double period_s) : period_s_(period_s) {}

  /// The poses of the robot contain this number of closures.
  void used(std::size_t closures) { used_ = closures; }

  /// Call it first in every step: from its time follows the duration of a refinement in the last
  /// one.
  [[nodiscard]] bool is_due(std::size_t closures, double now_s) {
    if (in_last_step_) {
      in_last_step_ = false;
      cost_s_ = now_s - began_s_;
    }
    return period_s_ > 0.0 && closures != used_ &&
           now_s - began_s_ >= std::max(period_s_, kLeastPause * cost_s_);
  }
  /// A refinement with this number of closures begins.
  void began(std::size_t closures, double now_s) {
    used(closures);
    began_s_ = now_s;
    in_last_step_ = true;
  }

 private:
  static constexpr double kLeastPause = 20.0;  // in durations of a refinement

  double period_s_;
  double began_s_ = -1e9;
  double cost_s_ = 0.0;
  std::size_t used_ = 0;
  bool in_last_step_ = false;
};

}  // namespace km
