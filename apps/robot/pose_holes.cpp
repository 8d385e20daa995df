#include "apps/robot/pose_holes.hpp"

#include <algorithm>

namespace km {

std::vector<PoseHole> pose_holes(std::span<const StampedPose> path) {
  if (path.size() < 2) return {};
  std::vector<double> intervals_s;
  intervals_s.reserve(path.size() - 1);
  for (std::size_t i = 1; i < path.size(); ++i)
    intervals_s.push_back(seconds_between(path[i - 1].stamp, path[i].stamp));
  const auto middle =
      intervals_s.begin() + static_cast<std::ptrdiff_t>((intervals_s.size() - 1) / 2);
  std::ranges::nth_element(intervals_s, middle);
  const double longest_s = std::max(kHole_s, kHoleIntervals * *middle);
  std::vector<PoseHole> holes;
  for (std::size_t i = 1; i < path.size(); ++i)
    if (seconds_between(path[i - 1].stamp, path[i].stamp) > longest_s)
      holes.push_back({path[i - 1].stamp, path[i].stamp});
  return holes;
}

}  // namespace km
