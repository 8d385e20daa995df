#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "modules/session/pose_graph_config.hpp"
#include "modules/session/team_messages.hpp"

namespace km {

/// When the coordinator of a team opens the next session. New measurements do not interrupt a
/// session. The next session waits until is_within_budget() and is_worthwhile() are true. Not
/// thread-safe.
class SessionSchedule {
 public:
  explicit SessionSchedule(const PoseGraphConfig& config) : config_(config) {}

  /// Takes the present plan: whether its graph has changed, the number of its closures between
  /// robots, and whether closures at several places join all members.
  void update(bool graph_changed, std::uint64_t closures, bool all_joined, double now_s) {
    if (graph_changed) changed_s_ = now_s;
    closures_ = closures;
    all_joined_ = all_joined;
  }
  /// Number for the next session; every call returns a new one.
  [[nodiscard]] std::uint32_t take_number() { return ++opened_; }
  /// To be called when a session begins. It has all present closures.
  void opened() { used_ = closures_; }

  /// True if the mean rate of the member that has sent most, `bytes` in the session that ended at
  /// `ended_s`, is within pose_graph.exchange_budget_kb_s by now. Also true after session_wait_s.
  [[nodiscard]] bool is_within_budget(std::uint64_t bytes, double ended_s, double now_s) const;
  /// True if the graph of the members has changed enough since the session that ended at `ended_s`.
  [[nodiscard]] bool is_worthwhile(double ended_s, double now_s) const;

 private:
  [[nodiscard]] bool has_new() const { return closures_ != used_; }
  [[nodiscard]] double patience() const;
  [[nodiscard]] double longest_wait_s() const;

  PoseGraphConfig config_;
  double changed_s_ = -1e9;     // time of the last change of the graph
  std::uint64_t closures_ = 0;  // between robots, in the present plan
  std::uint64_t used_ = 0;      // between robots, in the last session
  std::uint32_t opened_ = 0;
  bool all_joined_ = true;
};

/// Period of the messages of a coordinator, and of statuses [s].
inline constexpr double kTeamStatusPeriod_s = 1.0;

/// When a robot sends its status: when it has changed, but at most twice per period. It is sent
/// only once per period if nothing but keyframes and closures inside the robot are new, because
/// these open no session before the team is at rest. Not thread-safe.
class StatusSchedule {
 public:
  /// False if the last status is so recent that none is due.
  [[nodiscard]] bool may_be_due(double now_s) const;
  enum class Due { kNo, kProgress, kStatus };
  /// Whether to send `status` at `now_s`, or only to report the progress of this robot, once per
  /// period. The caller then does so.
  [[nodiscard]] Due due(const TeamStatus& status, double now_s);

 private:
  std::optional<TeamStatus> sent_;
  double last_s_ = -1e9;  // time of the last status or progress
};

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
