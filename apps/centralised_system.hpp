#pragma once

#include <string_view>

namespace km {

// The bytes of a team are compared with those that the server of a centralised system would
// receive: each keyframe once, with so many keypoints.

/// Category of the team's traffic that is not counted, because keypoints do not show the map.
inline constexpr std::string_view kMapTraffic = "map";

/// Sum over the categories of a team's traffic that are counted.
[[nodiscard]] double counted_bytes(const auto& bytes_by_category) {
  double sum = 0.0;
  for (const auto& [category, bytes] : bytes_by_category)
    if (category != kMapTraffic) sum += static_cast<double>(bytes);
  return sum;
}

/// Bytes of a keypoint at the server: 8 of position and 32 of ORB descriptor.
inline constexpr double kKeypointBytes = 40.0;

/// Bytes of `keyframes` at the server, with a mean of `keypoints` each.
[[nodiscard]] constexpr double server_bytes(double keyframes, double keypoints) {
  return keyframes * keypoints * kKeypointBytes;
}

}  // namespace km
