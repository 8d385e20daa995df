#include "modules/pose_graph/status_schedule.hpp"

#include <tuple>

namespace km {
namespace {

// Earliest time of a changed status, and of one with changed links [periods].
constexpr double kEarlyStatus = 0.5;
constexpr double kEarlyLinks = 0.05;

bool same_content(const TeamStatus& a, const TeamStatus& b) {
  const auto rest = [](const TeamStatus& s) {
    return std::tie(s.sender, s.receives, s.frame, s.frame_version, s.keyframes, s.revision,
                    s.offers, s.method, s.upright);
  };
  return rest(a) == rest(b) && a.T_odom_first.matrix() == b.T_odom_first.matrix();
}

}  // namespace

bool StatusSchedule::rests(double now_s) const {
  return now_s - sent_s_ < kEarlyLinks * period_s_;
}

bool StatusSchedule::may_be_due(const std::vector<TeamPeer>& receives, double now_s) const {
  const bool links_changed = !sent_ || sent_->receives != receives;
  return links_changed || now_s - sent_s_ >= kEarlyStatus * period_s_;
}

StatusSchedule::Due StatusSchedule::due(const TeamStatus& status, double now_s) {
  const bool changed = !sent_ || !same_content(status, *sent_);
  if (!changed && now_s - sent_s_ < period_s_) return Due::kNo;
  sent_s_ = now_s;
  if (!changed) return Due::kRepeat;
  sent_ = status;
  return Due::kNew;
}

}  // namespace km
