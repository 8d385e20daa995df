#pragma once

#include <optional>

#include "modules/pose_graph/team_messages.hpp"

namespace km {

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

}  // namespace km
