#include "modules/pose_graph/status_schedule.hpp"

#include <tuple>

namespace km {
namespace {

constexpr double kEarly = 0.5;  // earliest time of a changed status [periods]

bool same_graph_size(const TeamStatus& a, const TeamStatus& b) {
  return a.keyframes == b.keyframes && a.revision == b.revision;
}

// All except for keyframes and revision.
bool same_rest(const TeamStatus& a, const TeamStatus& b) {
  const auto rest = [](const TeamStatus& s) {
    return std::tie(s.sender, s.frame, s.frame_version, s.offers, s.method, s.upright, s.datum);
  };
  return rest(a) == rest(b) && a.T_odom_first.matrix() == b.T_odom_first.matrix();
}

}  // namespace

bool StatusSchedule::may_be_due(double now_s) const {
  return now_s - last_s_ >= kEarly * kTeamStatusPeriod_s;
}

StatusSchedule::Due StatusSchedule::due(const TeamStatus& status, double now_s) {
  const bool urgent = !sent_ || !same_rest(status, *sent_);
  if (!urgent && now_s - last_s_ < kTeamStatusPeriod_s) return Due::kNo;
  last_s_ = now_s;
  if (!urgent && same_graph_size(status, *sent_)) return Due::kProgress;
  sent_ = status;
  return Due::kStatus;
}

}  // namespace km
