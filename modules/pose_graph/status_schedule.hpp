#pragma once

#include <optional>
#include <vector>

#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// When a robot sends its status: once per period, and earlier if it has changed, at once if its
/// links have. Not thread-safe.
class StatusSchedule {
 public:
  explicit StatusSchedule(double period_s) : period_s_(period_s) {}

  /// True if the last status is so recent that nothing is due, not even changed links.
  [[nodiscard]] bool rests(double now_s) const;
  /// Unless it rests: true if a status with these `receives` may be due.
  [[nodiscard]] bool may_be_due(const std::vector<TeamPeer>& receives, double now_s) const;
  enum class Due { kNo, kRepeat, kNew };
  /// Whether to send `status` at `now_s`. The caller then does so.
  [[nodiscard]] Due due(const TeamStatus& status, double now_s);

 private:
  double period_s_;
  std::optional<TeamStatus> sent_;
  double sent_s_ = -1e9;
};

}  // namespace km
