#include "modules/absolute_fixes/fix_association.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

constexpr Stamp kPatience_ns = 2'000'000'000;  // delay of live fixes relative to images
constexpr double kLongestStep_s = 1.0;         // between the images around a fix

}  // namespace

FixAssociation::FixAssociation(const Eigen::Vector3d& p_body, double correlation_s,
                               const std::vector<TimedPosition>& recorded)
    : p_body_(p_body),
      correlation_s_(correlation_s),
      max_ahead_(recorded.size() + kMaxAhead),
      ahead_(recorded.begin(), recorded.end()),
      newest_fix_(recorded.empty() ? std::numeric_limits<Stamp>::min() : recorded.back().stamp) {}

void FixAssociation::add(const TimedPosition& fix) {
  ahead_.push_back(fix);
  newest_fix_ = fix.stamp;
  if (ahead_.size() <= max_ahead_) return;
  ahead_.pop_front();
  ++unused_;
}

// Pose of the body, interpolated at constant velocity.
std::optional<SE3> FixAssociation::pose_at(Stamp stamp) const {
  const auto after = std::ranges::lower_bound(poses_, stamp, {}, &StampedPose::stamp);
  if (after == poses_.end()) return std::nullopt;
  if (after->stamp == stamp) return after->T;
  if (after == poses_.begin()) return std::nullopt;
  const StampedPose& before = after[-1];
  const double step_s = seconds_between(before.stamp, after->stamp);
  if (!(step_s <= kLongestStep_s)) return std::nullopt;
  const double share = seconds_between(before.stamp, stamp) / step_s;
  return before.T * se3_exp(share * se3_log(before.T.inverse() * after->T));
}

// Finds the poses of keyframes and fixes up to the last pose. Fixes without one are not used.
void FixAssociation::locate() {
  for (TimedKeyframe& keyframe : keyframes_)
    if (!keyframe.T_odom_kf) keyframe.T_odom_kf = pose_at(keyframe.stamp);
  for (; !ahead_.empty() && ahead_.front().stamp <= poses_.back().stamp; ahead_.pop_front()) {
    if (auto T_odom_body = pose_at(ahead_.front().stamp))
      located_.push_back({ahead_.front(), *T_odom_body});
    else
      ++unused_;
  }
}

// Takes all fixes up to `end`, and returns that nearest to the keyframe.
std::optional<PositionFix> FixAssociation::nearest_fix(const TimedKeyframe& keyframe, Stamp end) {
  std::optional<PositionFix> nearest;
  Stamp least_ns = 0;
  for (; !located_.empty() && located_.front().fix.stamp <= end; located_.pop_front()) {
    ++unused_;
    const auto& [fix, T_odom_body] = located_.front();
    const Stamp distance_ns = std::abs(fix.stamp - keyframe.stamp);
    if (!keyframe.T_odom_kf || (nearest && distance_ns >= least_ns)) continue;
    least_ns = distance_ns;
    nearest = PositionFix{.keyframe = keyframe.id,
                          .p_datum = fix.p_datum,
                          .p_kf = keyframe.T_odom_kf->inverse() * (T_odom_body * p_body_),
                          .sigma_m = fix.sigma_m,
                          .stamp = fix.stamp,
                          .correlation_s = correlation_s_};
  }
  if (nearest) --unused_;
  return nearest;
}

std::vector<PositionFix> FixAssociation::take(std::uint64_t datum) {
  std::vector<PositionFix> taken;
  if (poses_.empty()) return taken;
  locate();
  const Stamp now = poses_.back().stamp;
  while (keyframes_.size() > 1) {
    const Stamp middle = keyframes_[0].stamp + (keyframes_[1].stamp - keyframes_[0].stamp) / 2;
    const bool has_come = newest_fix_ > middle;
    if (now < keyframes_[1].stamp || (!has_come && now < middle + kPatience_ns)) break;
    if (auto fix = nearest_fix(keyframes_[0], middle)) {
      fix->datum = datum;
      taken.push_back(*fix);
    }
    while (poses_.size() > 1 && poses_[1].stamp <= keyframes_[0].stamp) poses_.pop_front();
    keyframes_.pop_front();
  }
  forget_before(now - kDelay_ns);
  return taken;
}

// A robot at rest makes no keyframe. The next keyframe comes after `end`, so that of the fixes
// before `end` only the last one can be nearest to it. The keyframe before takes one of the two
// beside it.
void FixAssociation::forget_before(Stamp end) {
  while (poses_.size() > 1 && poses_[1].stamp <= end) poses_.pop_front();
  if (keyframes_.size() > 1) return;
  const auto until = [this](Stamp stamp) {
    return std::ranges::upper_bound(located_, stamp, {},
                                    [](const LocatedFix& located) { return located.fix.stamp; }) -
           located_.begin();
  };
  const auto first = keyframes_.empty() ? 0 : until(keyframes_.front().stamp) + 1;
  const auto last = until(end) - 1;
  if (first >= last) return;
  unused_ += static_cast<std::size_t>(last - first);
  located_.erase(located_.begin() + first, located_.begin() + last);
}

}  // namespace km
