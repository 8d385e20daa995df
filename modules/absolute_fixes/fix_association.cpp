#include "modules/absolute_fixes/fix_association.hpp"

#include <algorithm>
#include <cstdlib>

#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr Stamp kPatience_ns = 2'000'000'000;  // delay of live fixes relative to images
constexpr double kLongestStep_s = 1.0;         // between the images around a fix

}  // namespace

// Pose of the body, interpolated at constant velocity.
std::optional<SE3> FixAssociation::pose_at(Stamp stamp) const {
  const auto after = std::ranges::lower_bound(states_, stamp, {}, &OdometryState::stamp);
  if (after == states_.end()) return std::nullopt;
  if (after->stamp == stamp) return after->T_odom_body;
  if (after == states_.begin()) return std::nullopt;
  const OdometryState& before = after[-1];
  const double step_s = seconds_between(before.stamp, after->stamp);
  if (step_s > kLongestStep_s) return std::nullopt;
  const double share = seconds_between(before.stamp, stamp) / step_s;
  return before.T_odom_body *
         se3_exp(share * se3_log(before.T_odom_body.inverse() * after->T_odom_body));
}

// Takes all fixes up to `end`, and returns that nearest to the keyframe.
std::optional<PositionFix> FixAssociation::nearest_fix(const TimedKeyframe& keyframe, Stamp end) {
  const std::optional<SE3> T_odom_kf = pose_at(keyframe.stamp);
  std::optional<PositionFix> nearest;
  Stamp least_ns = 0;
  for (; !fixes_.empty() && fixes_.front().stamp <= end; fixes_.pop_front()) {
    ++unused_;
    const TimedPosition& fix = fixes_.front();
    const Stamp distance_ns = std::abs(fix.stamp - keyframe.stamp);
    if (!T_odom_kf || (nearest && distance_ns >= least_ns)) continue;
    const auto T_odom_body = pose_at(fix.stamp);
    if (!T_odom_body) continue;
    least_ns = distance_ns;
    nearest = PositionFix{.keyframe = keyframe.id,
                          .p_datum = fix.p_datum,
                          .p_kf = T_odom_kf->inverse() * (*T_odom_body * p_body_),
                          .sigma_m = fix.sigma_m,
                          .stamp = fix.stamp,
                          .correlation_s = correlation_s_};
  }
  if (nearest) --unused_;
  return nearest;
}

std::vector<PositionFix> FixAssociation::take(std::uint64_t datum) {
  std::vector<PositionFix> taken;
  while (keyframes_.size() > 1 && !states_.empty()) {
    const Stamp middle = keyframes_[0].stamp + (keyframes_[1].stamp - keyframes_[0].stamp) / 2;
    const bool has_come = !fixes_.empty() && fixes_.back().stamp > middle;
    const Stamp now = states_.back().stamp;
    if (now < keyframes_[1].stamp || (!has_come && now < middle + kPatience_ns)) break;
    if (auto fix = nearest_fix(keyframes_[0], middle)) {
      fix->datum = datum;
      taken.push_back(*fix);
    }
    while (states_.size() > 1 && states_[1].stamp <= keyframes_[0].stamp) states_.pop_front();
    keyframes_.pop_front();
  }
  return taken;
}

}  // namespace km
