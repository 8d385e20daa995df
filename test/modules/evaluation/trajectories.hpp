#pragma once

#include <vector>

#include "modules/core/lie.hpp"
#include "modules/core/stamped_pose.hpp"

namespace km {

inline constexpr Stamp kSecond = 1'000'000'000;

/// `count` poses at `rate_hz` from `from_s` on; pose(t_s) returns each.
template <typename Pose>
std::vector<StampedPose> sample(double from_s, double rate_hz, int count, const Pose& pose) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < count; ++i) {
    const double t_s = from_s + i / rate_hz;
    poses.push_back({static_cast<Stamp>(t_s * 1e9 + 0.5), pose(t_s)});
  }
  return poses;
}

/// A smooth curve without symmetries.
inline SE3 curve(double t_s) {
  return make_pose(so3_exp({0.3 * std::sin(t_s), 0.2 * std::cos(0.7 * t_s), 0.5 * t_s}),
                   {std::sin(t_s), std::cos(0.8 * t_s) + 0.1 * t_s, 0.3 * std::sin(1.7 * t_s)});
}

}  // namespace km
