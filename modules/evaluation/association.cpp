#include "modules/evaluation/association.hpp"

#include <algorithm>
#include <cmath>

namespace km {
namespace {

bool is_before(const StampedPose& pose, Stamp stamp) {
  return pose.stamp < stamp;
}

SE3 interpolate(const StampedPose& a, const StampedPose& b, Stamp stamp) {
  const double share = seconds_between(a.stamp, stamp) / seconds_between(a.stamp, b.stamp);
  const Eigen::Quaterniond q_a(a.T.rotation());
  const Eigen::Quaterniond q_b(b.T.rotation());
  return make_pose(q_a.slerp(share, q_b).toRotationMatrix(),
                   (1.0 - share) * a.T.translation() + share * b.T.translation());
}

std::span<const StampedPose> within(std::span<const StampedPose> poses, const TimeWindow& window) {
  const auto first = std::lower_bound(poses.begin(), poses.end(), window.from, is_before);
  const auto last = std::lower_bound(first, poses.end(), window.to + 1, is_before);
  return {first, last};
}

}  // namespace

std::optional<SE3> pose_at(std::span<const StampedPose> poses, Stamp stamp, double max_gap_s,
                           double max_difference_s) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), stamp, is_before);
  if (after != poses.end() && after->stamp == stamp) return after->T;
  const bool inside = after != poses.begin() && after != poses.end();
  if (inside && seconds_between(std::prev(after)->stamp, after->stamp) <= max_gap_s)
    return interpolate(*std::prev(after), *after, stamp);

  const auto difference_s = [&](auto pose) {
    return std::abs(seconds_between(pose->stamp, stamp));
  };
  auto nearest = after;
  if (after == poses.end() || (inside && difference_s(std::prev(after)) < difference_s(after))) {
    if (after == poses.begin()) return std::nullopt;  // there are no poses
    nearest = std::prev(after);
  }
  if (difference_s(nearest) > max_difference_s) return std::nullopt;
  return nearest->T;
}

std::vector<PosePair> associate(std::span<const StampedPose> truth,
                                std::span<const StampedPose> estimate, const TimeWindow& window) {
  if (truth.empty() || estimate.empty()) return {};
  const Stamp margin = nanoseconds(kMaxDifference_s);
  const TimeWindow shared = {
      std::max(window.from, std::max(truth.front().stamp, estimate.front().stamp) - margin),
      std::min(window.to, std::min(truth.back().stamp, estimate.back().stamp) + margin)};
  if (shared.from > shared.to) return {};
  const auto truth_inside = within(truth, shared);
  const auto estimate_inside = within(estimate, shared);
  const bool at_estimate = estimate_inside.size() <= truth_inside.size();

  std::vector<PosePair> pairs;
  for (const StampedPose& pose : at_estimate ? estimate_inside : truth_inside) {
    const auto other = pose_at(at_estimate ? truth : estimate, pose.stamp);
    if (!other) continue;
    if (at_estimate)
      pairs.push_back({pose.stamp, *other, pose.T});
    else
      pairs.push_back({pose.stamp, pose.T, *other});
  }
  return pairs;
}

double covered_seconds(std::span<const StampedPose> poses, const TimeWindow& window,
                       double max_gap_s) {
  Stamp covered = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (seconds_between(poses[i - 1].stamp, poses[i].stamp) > max_gap_s) continue;
    const Stamp from = std::max(poses[i - 1].stamp, window.from);
    const Stamp to = std::min(poses[i].stamp, window.to);
    covered += std::max<Stamp>(0, to - from);
  }
  return seconds_between(0, covered);
}

}  // namespace km
