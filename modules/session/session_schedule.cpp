#include "modules/session/session_schedule.hpp"

#include <tuple>

namespace km {
namespace {

// Time without new measurements after which the team is at rest [s].
constexpr double kAtRest_s = 2.0;
// Factor on the longest wait while no closure between robots is new.
constexpr double kIdle = 4.0;
// Factor on the waits while the place of a member in the team's frame is not certain. A session may
// join it, or correct a frame that is wrong as a whole.
constexpr double kNotJoined = 0.25;

constexpr double kEarly = 0.5;  // earliest time of a changed status [periods]

bool same_graph_size(const TeamStatus& a, const TeamStatus& b) {
  return a.keyframes == b.keyframes && a.revision == b.revision;
}

// All except for keyframes and revision.
bool same_rest(const TeamStatus& a, const TeamStatus& b) {
  const auto rest = [](const TeamStatus& s) {
    return std::tie(s.sender, s.offers, s.method, s.upright, s.datum);
  };
  return rest(a) == rest(b) && a.T_odom_first.matrix() == b.T_odom_first.matrix();
}

}  // namespace

bool SessionSchedule::is_within_budget(std::uint64_t bytes, double ended_s, double now_s) const {
  const double price_s = static_cast<double>(bytes) / (1e3 * config_.exchange_budget_kb_s);
  return now_s - ended_s >= std::min(price_s, config_.session_wait_s);
}

double SessionSchedule::patience() const {
  return all_joined_ ? 1.0 : kNotJoined;
}

double SessionSchedule::longest_wait_s() const {
  return (has_new() ? 1.0 : kIdle) * patience() * config_.session_wait_s;
}

// The first closures between robots connect the maps; each further closure changes them less.
// Closures inside a robot change only its own poses, and a robot that moves at known places finds
// them all the time, so they can wait. Odometry alone changes nothing, so new odometry can wait
// until the team is at rest.
bool SessionSchedule::is_worthwhile(double ended_s, double now_s) const {
  const bool grown =
      has_new() && static_cast<double>(closures_) >=
                       (1.0 + patience() * config_.session_growth) * static_cast<double>(used_);
  return grown || now_s - changed_s_ >= kAtRest_s || now_s - ended_s >= longest_wait_s();
}

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
